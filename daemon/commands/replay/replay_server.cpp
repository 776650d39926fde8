#include "daemon/commands/replay/replay_server.hpp"

#include <csignal>
#include <cstdlib>

#include "daemon/config/sonar_addresses.hpp"
#include "daemon/emulator/connections/outbox.hpp"
#include "daemon/server/http/http_router.hpp"
#include "daemon/server/system/listen.hpp"
#include "daemon/server/time/clock.hpp"

namespace sonar {
namespace {

constexpr auto goodbye_limit = std::chrono::milliseconds(1500);
constexpr auto status_period = std::chrono::seconds(1);
constexpr auto part_gap = std::chrono::microseconds(20);  // time between the datagrams of a frame

std::string text_of_bytes(std::uint64_t bytes) { return std::to_string((bytes + 500'000) / 1'000'000) + " MB"; }

}  // namespace

ReplayServer::ReplayServer(asio::io_context& io, recording::RecordingReader& reader, ReplayDevice device, ReplayOptions options,
                           Log& log)
    : io_(io),
      reader_(reader),
      device_(std::move(device)),
      options_(std::move(options)),
      log_(log),
      acceptor_(io),
      status_(io),
      status_timer_(io),
      deadline_(io),
      signals_(io) {}

Result<void> ReplayServer::open() {
  at_ = options_.at;
  network_.bind_ip = network_.advertise_ip = at_.ip;
  derive_addresses(network_);
  if (!device_.is_only_seen.empty()) return {};
  if (device_.http() != nullptr) return open_http();
  if (Result<void> listening = listen_tcp(acceptor_, at_); !listening) return listening;
  error_code ec;
  at_.port = acceptor_.local_endpoint(ec).port();
  for (const Endpoint& to : options_.status_to.empty() ? network_.status_to : options_.status_to)
    if (device_.status_port() != 0) status_to_.emplace_back(address_of(to.ip), to.port == 0 ? device_.status_port() : to.port);
  if (Result<void> bound = bind_udp(status_, {at_.ip, 0}, true); !bound) return bound;
  send_multicast_from(status_, at_.ip);
  return {};
}

Result<void> ReplayServer::open_http() {
  const auto answer = [this](const protocol::ResourceRequest& request) {
    protocol::ResourceReply reply = device_.vendor->on_http(*device_.http(), request, *device_.state, Clock::system_wall());
    figures_.clients = 1;
    if (!client_) return reply;
    for (const protocol::Event& event : reply.events) apply(*client_, event);
    client_->wake.cancel();
    return reply;
  };
  http_ = std::make_unique<SonarHttp>(
      io_, limits_, admission_, log_, device_.name(), [] { return std::vector<std::string>{}; }, answer);
  if (Result<void> listening = http_->open(at_); !listening) return listening;
  at_ = http_->at();
  client_ = std::make_shared<Client>(tcp::socket(io_), limits_);
  client_->name = "http";
  if (Result<void> bound = bind_udp(status_, {at_.ip, 0}, true); !bound) return bound;
  send_multicast_from(status_, at_.ip);
  return {};
}

/// An exception in one of the coroutines ends the replay. Otherwise the server would continue without serving a client.
void ReplayServer::spawn(auto coroutine) {
  asio::co_spawn(io_, std::move(coroutine), [this](std::exception_ptr fault) {
    if (!fault) return;
    outcome_ = failure(ErrorKind::bug, "internal fault: " + text_of(fault) + " (please report it); it ended the replay");
    end();
  });
}

// There is one client at a time. Its serve() sends messages when they are due, and also the replies; its listen_to() reads the
// requests. The replay ends after the recording or stop(), when the client has received FIN or, after goodbye_limit, RST.
void ReplayServer::start() {
  if (!device_.is_only_seen.empty()) {
    // Only the page is served, until a signal comes.
  } else if (http_) {
    http_->start();
    spawn(serve(client_));
  } else {
    spawn(accept());
    spawn(send_status());
  }
  if (options_.handle_signals) spawn(watch_signals());
}

asio::awaitable<void> ReplayServer::watch_signals() {
  error_code ec;
  signals_.add(SIGINT, ec);
  signals_.add(SIGTERM, ec);
  co_await signals_.async_wait(into(ec));
  if (ec || over_) co_return;
  stop();
  if (over_) co_return;  // stop() has ended the replay without a client
  co_await signals_.async_wait(into(ec));
  if (!ec && !over_) std::_Exit(EXIT_FAILURE);  // a second signal ends the program at once
}

/// Ends the replay after the present message. A client that does not receive the message within the limit is reset.
void ReplayServer::stop() {
  if (stopping_ || over_) return;
  stopping_ = true;
  error_code ec;
  acceptor_.close(ec);
  if (!client_) return end();
  client_->wake.cancel();
  deadline_.expires_after(goodbye_limit);
  deadline_.async_wait([this](const error_code& e) {
    if (!e && client_) close_by_reset(client_->socket);
  });
}

/// Ends all work that would keep io.run() running.
void ReplayServer::end() {
  over_ = true;
  error_code ec;
  if (http_) http_->stop();
  acceptor_.close(ec);
  status_.close(ec);
  if (client_) client_->socket.close(ec);
  status_timer_.cancel();
  deadline_.cancel();
  signals_.cancel(ec);
  if (options_.on_end) options_.on_end();
}

/// Accepts one client, and refuses others while it is connected. Two coroutines share a client: serve() writes, listen_to()
/// reads.
asio::awaitable<void> ReplayServer::accept() {
  while (!over_ && !stopping_) {
    error_code ec;
    tcp::socket socket(io_);
    co_await acceptor_.async_accept(socket, into(ec));
    if (over_ || stopping_) co_return;
    if (ec) {  // for example, no descriptor is free: try again
      asio::steady_timer pause(io_, std::chrono::milliseconds(100));
      co_await pause.async_wait(into(ec));
      continue;
    }
    const auto client = std::make_shared<Client>(std::move(socket), limits_);
    const tcp::endpoint peer = client->socket.remote_endpoint(ec);
    if (ec) continue;
    client->name = peer.address().to_string() + ":" + std::to_string(peer.port());
    if (client_) {
      ++figures_.refused;
      log_limited(log_, refused_limit_, LogLevel::info, "client refused: another one is being served",
                  {{"client", client->name}});
      continue;  // closes the socket
    }
    client->ip = peer.address().to_v4().to_bytes();
    client->socket.set_option(tcp::no_delay(true), ec);
    client->socket.set_option(asio::socket_base::keep_alive(true), ec);
    client_ = client;
    if (device_.vendor != nullptr) {
      device_.state->connected_client = client->ip;
      device_.state->settings.reset();
      client->dialogue = device_.vendor->converse(*device_.vendor->port(protocol::Port::Kind::tcp_stream), *device_.state, {});
      client->wants_frames = !device_.by_datagrams() && device_.vendor->pings_before_first_request(*device_.state);
      status_timer_.cancel();  // sends the next status at once
    }
    ++figures_.clients;
    log_.info("client connected", {{"client", client->name}});
    spawn(serve(client));
    spawn(listen_to(client));
  }
}

/// Sends the recording once, or repeatedly with `loop`, and then closes the connection or ends the replay.
asio::awaitable<void> ReplayServer::serve(ClientPointer client) {
  std::optional<std::chrono::nanoseconds> interval;
  if (!reader_.knows_times()) interval = nanoseconds_from(1 / options_.rate_hz);
  ReplayPace pace(options_.speed, interval);
  const std::uint64_t messages = figures_.messages, bytes = figures_.bytes;
  Played played = Played::to_the_end;
  do {
    reader_.rewind();
    played = co_await play(client, pace);
    pace.begin_again();
    if (played == Played::to_the_end) ++figures_.times_through;
  } while (played == Played::to_the_end && options_.loop && !stopping_);
  if (played != Played::left) co_await close_stream(client);
  error_code ec;
  client->socket.close(ec);
  client_.reset();
  if (device_.vendor != nullptr) status_timer_.cancel();
  const char* const how = played == Played::to_the_end ? "recording served to its end"
                          : played == Played::left     ? "client left"
                                                       : "stopped";
  log_.info(
      how,
      {{"client", client->name}, {"messages", figures_.messages - messages}, {"sent", text_of_bytes(figures_.bytes - bytes)}});
  if (stopping_ || played == Played::to_the_end) end();
}

/// Sends the device's messages in order. Before each message it sends waiting replies, waits until the host has requested pings,
/// and waits until the message is due.
asio::awaitable<ReplayServer::Played> ReplayServer::play(ClientPointer client, ReplayPace& pace) {
  bool any = false;
  const auto carrier = device_.by_datagrams() ? recording::Carrier::datagram : recording::Carrier::stream;
  error_code ec;
  while (auto message = co_await reader_.next()) {
    if (message->from != recording::Origin::device || message->by != carrier) continue;
    co_await send_replies(client);
    while (device_.vendor != nullptr && !client->wants_frames && !ends(*client)) {
      client->wake.expires_at(Steady::time_point::max());
      co_await client->wake.async_wait(into(ec));
      co_await send_replies(client);
      pace.begin_again();
    }
    const bool begins = !device_.by_datagrams() || http_ || device_.vendor->region(protocol::Region::metadata, message->bytes);
    client->frames += begins;
    if (!options_.stepped && !ends(*client)) {
      client->wake.expires_at(begins ? pace.due(message->at, Steady::now()) : Steady::now() + part_gap);
      do {
        co_await client->wake.async_wait(into(ec));
        co_await send_replies(client);
      } while (ec && !ends(*client) && client->wake.expiry() > Steady::now());
    }
    if (ends(*client)) co_return stopping_ ? Played::stopped : Played::left;
    if (device_.by_datagrams()) {
      if (!http_ && !number_datagram(*client, message->bytes)) continue;
      co_await send_datagram(client, message->bytes);
    } else {
      if (!co_await write(client, message->bytes)) co_return stopping_ ? Played::stopped : Played::left;
    }
    figures_.messages += begins;
    figures_.bytes += message->bytes.size();
    any = true;
  }
  if (const auto damage = reader_.damage(); damage && !std::exchange(damage_logged_, true)) log_.warning(damage->text);
  co_return any ? Played::to_the_end : Played::left;
}

/// Numbers the frames of each connection from 1, also if some are left out or the recording restarts. Returns false if the
/// datagram belongs to no frame.
bool ReplayServer::number_datagram(const Client& client, protocol::Bytes& datagram) const {
  const auto number = [&](auto) { return client.frames - 1; };
  return client.frames > 0 &&
         device_.vendor->change_integer(protocol::Part::ping, protocol::FieldName::ping_id, number, datagram);
}

/// Sends to a copy of the list of receivers, because a request of the host may change the list during a send.
asio::awaitable<void> ReplayServer::send_datagram(ClientPointer client, const protocol::Bytes& datagram) {
  const std::vector<udp::endpoint> receivers = client->receivers;
  for (const udp::endpoint& to : receivers) {
    error_code ec;
    co_await status_.async_send_to(asio::buffer(datagram), to, into(ec));
    if (ec && !over_)
      log_limited(log_, unsent_limit_, LogLevel::warning, "cannot send frames: " + ec.message(),
                  {{"to", to.address().to_string()}});
  }
}

/// Sends the replies; only one coroutine writes the stream.
asio::awaitable<void> ReplayServer::send_replies(ClientPointer client) {
  while (!client->replies.empty()) {
    const protocol::Bytes replies = std::exchange(client->replies, {});
    if (!co_await write(client, replies)) co_return;
  }
}

/// Returns false if the client has left or was reset. The bytes must outlive the write.
asio::awaitable<bool> ReplayServer::write(ClientPointer client, protocol::BytesView bytes) {
  error_code ec;
  while (!bytes.empty() && !ec) {
    watch_stall(client);
    bytes = bytes.subspan(co_await client->socket.async_write_some(asio::buffer(bytes.data(), bytes.size()), into(ec)));
    client->stall.cancel();
  }
  co_return !ec;
}

/// Resets a client that reads nothing, because it would keep the only slot. An emulated sonar does the same.
void ReplayServer::watch_stall(const ClientPointer& client) {
  client->stall.expires_after(options_.stall);
  client->stall.async_wait([this, client](const error_code& ec) {
    if (ec || over_ || !client->socket.is_open()) return;
    ++figures_.stalled;
    log_.warning("client reset: it read no byte for " + std::to_string(options_.stall.count()) + " ms",
                 {{"client", client->name}});
    close_by_reset(client->socket);
  });
}

/// Handles requests of a host, which determine the receivers of frames and the time of the first frame. The server
/// disconnects a host that does not read the answers, as an emulated sonar does.
void ReplayServer::on_client_bytes(Client& client, protocol::BytesView bytes) {
  client.heard = Steady::now();
  const protocol::Reaction reaction = client.dialogue->on_bytes(bytes, {});
  for (const protocol::Bytes& reply : reaction.replies) client.replies.insert(client.replies.end(), reply.begin(), reply.end());
  if (client.replies.size() > Outbox::most_reply_bytes) {
    ++figures_.greedy;
    log_limited(log_, notice_limit_, LogLevel::warning, "client closed: it sends requests faster than it reads the answers",
                {{"client", client.name}});
    error_code ignored;
    client.socket.close(ignored);
    return;
  }
  for (const protocol::Event& event : reaction.events) apply(client, event);
  client.wake.cancel();
}

/// Applies the part of a host's request that concerns the replay: whether frames are sent, and to which receivers. Other settings
/// have no effect.
void ReplayServer::apply(Client& client, const protocol::Event& event) {
  const protocol::Port* const stream = device_.vendor->port(protocol::Port::Kind::udp_stream);
  const auto send_to = [&](const protocol::SetReceivers& set) {
    client.receivers.clear();
    for (const Endpoint& to : set.to) {
      const Ipv4 ip = to.ip == Ipv4{} ? client.ip : to.ip;
      if (stream != nullptr && may_receive(ip, *stream, network_))
        client.receivers.emplace_back(address_of(ip), to.port);
      else
        log_limited(log_, unsent_limit_, LogLevel::warning,
                    "no frames are sent to broadcast addresses or foreign multicast groups", {{"to", text_of(ip)}});
    }
  };
  error_code ec;
  if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
    device_.state->settings = change->vendor_settings;
    client.wants_frames = change->settings.rate_hz > 0;
    if (change->receivers) send_to(*change->receivers);
  } else if (const auto* set = std::get_if<protocol::SetReceivers>(&event)) {
    send_to(*set);
  } else if (const auto* notice = std::get_if<protocol::Notice>(&event)) {
    log_limited(log_, notice_limit_, LogLevel::warning, notice->text, {{"client", client.name}});
  } else if (std::holds_alternative<protocol::Close>(event)) {
    client.socket.close(ec);
  }
}

/// Ends the connection of a silent client, as the device does, if the dialogue has a keep-alive.
void ReplayServer::end_if_silent() {
  if (!client_ || !client_->dialogue) return;
  const auto limit = client_->dialogue->longest_silence();
  error_code ec;
  if (limit && Steady::now() - client_->heard > *limit) client_->socket.close(ec);
}

/// Reads what a client sends. Most bytes have no effect, but are read so that the client can continue to send, at up to
/// limits.input_bytes_per_s.
asio::awaitable<void> ReplayServer::listen_to(ClientPointer client) {
  std::array<std::byte, 4096> ignored;
  HttpDetector http;
  asio::steady_timer pause(io_);
  bool logged = false;
  while (true) {
    error_code ec;
    const std::size_t n = co_await client->socket.async_read_some(asio::buffer(ignored), into(ec));
    if (ec) break;
    figures_.client_bytes += n;
    if (http.speaks_http(std::span(ignored).first(n))) break;
    if (client->dialogue) on_client_bytes(*client, protocol::BytesView(ignored).first(n));
    if (!std::exchange(logged, true)) log_.info("settings of a client have no effect on a recording", {{"client", client->name}});
    pause.expires_after(client->input.pause_after(n, Steady::now()));
    co_await pause.async_wait(into(ec));
  }
  client->gone = true;
  client->wake.cancel();
}

/// Ends the stream to the client, then waits for the end of the client's stream, so that a reset cannot discard the last bytes.
asio::awaitable<void> ReplayServer::close_stream(ClientPointer client) {
  error_code ec;
  client->socket.shutdown(tcp::socket::shutdown_send, ec);
  client->wake.expires_after(goodbye_limit);
  if (!client->gone && !ec) co_await client->wake.async_wait(into(ec));
}

asio::awaitable<void> ReplayServer::send_status() {
  bool logged = false;
  while (!over_) {
    end_if_silent();
    const protocol::Bytes status = device_.status_at(at_.ip, network_.netmask, client_ ? client_->ip : Ipv4{});
    error_code ec;
    for (const udp::endpoint& to : status_to_) {
      co_await status_.async_send_to(asio::buffer(status), to, into(ec));
      if (over_) co_return;
      if (ec && !std::exchange(logged, true))
        log_.warning("cannot send status: " + ec.message(), {{"to", to.address().to_string()}});
    }
    status_timer_.expires_after(status_period);
    co_await status_timer_.async_wait(into(ec));
  }
}

}  // namespace sonar
