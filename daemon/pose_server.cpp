#include "daemon/pose_server.hpp"

#include <algorithm>
#include <array>

#include "daemon/listen.hpp"
#include "protocol/control/delimited.hpp"
#include "protocol/control/json_pose.hpp"

namespace sonar {
namespace {

constexpr std::size_t most_connections = 32;
constexpr auto wall_tolerance = std::chrono::milliseconds(1);
constexpr auto accept_pause = std::chrono::milliseconds(100);
constexpr std::chrono::milliseconds dead_after{30000};             // a sender whose computer answers nothing
constexpr auto silence_before_eviction = std::chrono::seconds(1);  // newcomers do not push out those who send

Sender sender_of(bool json, const char* transport, const asio::ip::address& ip, std::uint16_t port) {
  const std::string encoding = json ? "json" : "protobuf";
  const std::string address = ip.to_string();
  return {encoding + " " + transport + " " + address + ":" + std::to_string(port), encoding + " " + address};
}

}  // namespace

PoseServer::PoseServer(asio::io_context& io, const PoseConfig& config, World& world, const Clock& clock, Log& log,
                       std::function<void()> on_pose)
    : io_(io), config_(config), world_(world), clock_(clock), log_(log), on_pose_(std::move(on_pose)) {}

Result<Endpoint> PoseServer::open(Listener& listener, Endpoint at) {
  if (auto r = listen_tcp(listener.acceptor, at); !r) return tl::make_unexpected(r.error());
  at.port = listener.acceptor.local_endpoint().port();  // for port 0: the same number for both
  if (auto r = bind_udp(listener.datagrams, at, false); !r) return tl::make_unexpected(r.error());
  return at;
}

Result<void> PoseServer::open() {
  const auto add = [this](Encoding encoding, const PoseListener& wanted, Endpoint& out) -> Result<void> {
    if (!wanted.enabled) return {};
    listeners_.push_back(Listener{encoding, udp::socket(io_), tcp::acceptor(io_)});
    const auto at = open(listeners_.back(), wanted.at);
    if (!at) {
      const std::string key = encoding == Encoding::json ? "poses.json" : "poses.protobuf";
      return failure(at.error().kind, at.error().text + "; " + key + " in the configuration takes another address, or off");
    }
    out = *at;
    return {};
  };
  if (auto r = add(Encoding::protobuf, config_.protobuf, protobuf_at_); !r) return r;
  return add(Encoding::json, config_.json, json_at_);
}

void PoseServer::start() {
  for (Listener& l : listeners_) {
    keep_receiving(l);
    keep_accepting(l);
  }
}

void PoseServer::say_fault(const std::exception_ptr& fault, const std::string& at) {
  std::uint64_t unsaid = 0;
  if (faults_.allows(LogLimiter::Clock::now(), unsaid))
    log_.error("internal fault: " + text_of(fault) + " (please report it)", {{"at", at}, {"unsaid", unsaid}});
}

/// A listener outlives whatever one message does to us.
void PoseServer::keep_receiving(Listener& listener) {
  asio::co_spawn(
      io_, [this, &listener] { return receive(listener); },
      [this, &listener](std::exception_ptr fault) {
        if (!fault || stopping_) return;
        say_fault(fault, "pose datagrams");
        keep_receiving(listener);
      });
}
void PoseServer::keep_accepting(Listener& listener) {
  asio::co_spawn(
      io_, [this, &listener] { return accept(listener); },
      [this, &listener](std::exception_ptr fault) {
        if (!fault || stopping_) return;
        say_fault(fault, "pose connections");
        keep_accepting(listener);
      });
}

void PoseServer::stop() {
  stopping_ = true;
  error_code ec;
  for (Listener& l : listeners_) {
    l.datagrams.close(ec);
    l.acceptor.close(ec);
  }
  for (const ConnectionPointer& c : connections_) c->socket.close(ec);
}

bool PoseServer::allowed(const asio::ip::address& from) {
  if (config_.allow_from.empty()) return true;  // then the listener is on loopback: the configuration sees to that
  const protocol::Ipv4 ip = from.is_v4() ? from.to_v4().to_bytes() : protocol::Ipv4{};
  return std::any_of(config_.allow_from.begin(), config_.allow_from.end(), [&](const AddressRange& r) { return r.contains(ip); });
}

// ---- what arrives

void PoseServer::say_refusal(const std::string& why, const Sender& sender) {
  std::uint64_t unsaid = 0;
  if (refusals_.allows(LogLimiter::Clock::now(), unsaid))
    log_.warning("pose refused: " + why, {{"from", sender.id}, {"unsaid", unsaid}});
}

void PoseServer::refuse(const std::string& why, const Sender& sender) {
  world_.count_refused();
  say_refusal(why, sender);
}

/// WALL stamps are of the clocks as they are now, also when somebody has set ours since we started; the World has a time of its
/// own that never jumps. A shift is kept while it is right to a millisecond, so that equal stamps stay equal.
void PoseServer::map_wall(control::Stamp& stamp) {
  if (stamp.domain != control::ClockDomain::wall || clock_.stepped()) return;
  const auto shift = clock_.ahead_of_wall();
  if (std::chrono::abs(shift - wall_shift_) > wall_tolerance) wall_shift_ = shift;
  stamp.ns += wall_shift_.count();
}

std::string PoseServer::take(control::PoseSample sample, const Sender& sender) {
  map_wall(sample.stamp);
  const PoseOutcome outcome = world_.accept(sample, sender, clock_.now());
  if (!outcome.refusal.empty() && outcome.verdict != PoseVerdict::late) say_refusal(outcome.refusal, sender);
  std::uint64_t unsaid = 0;
  if (!outcome.notice.empty() && notices_.allows(LogLimiter::Clock::now(), unsaid)) log_.info(outcome.notice);
  on_pose_();
  return outcome.refusal;
}

void PoseServer::on_line(const std::string& text, const Sender& sender) {
  if (const auto sample = control::parse_json_pose(text))
    take(*sample, sender);
  else
    refuse(sample.error().text, sender);
}

void PoseServer::on_datagram(Encoding encoding, std::span<const std::byte> bytes, const udp::endpoint& from) {
  const Sender sender = sender_of(encoding == Encoding::json, "udp", from.address(), from.port());
  if (encoding == Encoding::json) {  // a datagram holds whole lines; the last may lack its newline
    control::LineParser lines;
    lines.feed(bytes);
    lines.feed(std::array{std::byte{'\n'}});
    while (const auto line = lines.next())
      line->too_long ? refuse("line is longer than 4096 bytes", sender) : on_line(line->text, sender);
    return;
  }
  if (const auto sample = control::decode_pose_datagram(bytes))
    take(*sample, sender);
  else
    refuse(sample.error().text, sender);
}

asio::awaitable<void> PoseServer::receive(Listener& listener) {
  std::vector<std::byte> buffer(65536);
  while (!stopping_) {
    error_code ec;
    udp::endpoint from;
    const std::size_t n = co_await listener.datagrams.async_receive_from(asio::buffer(buffer), from, into(ec));
    if (stopping_) co_return;
    if (ec) continue;  // an ICMP answer to nothing we sent
    if (!allowed(from.address())) {
      refuse("address is not in poses.allow_from", sender_of(false, "udp", from.address(), from.port()));
      continue;
    }
    on_datagram(listener.encoding, std::span(buffer).first(n), from);
  }
}

// ---- streams

asio::awaitable<void> PoseServer::accept(Listener& listener) {
  while (!stopping_) {
    error_code ec;
    tcp::socket socket = co_await listener.acceptor.async_accept(into(ec));
    if (stopping_) co_return;
    if (ec) {
      asio::steady_timer pause(io_, accept_pause);
      co_await pause.async_wait(into(ec));
      continue;
    }
    const auto peer = socket.remote_endpoint(ec);
    const bool json = listener.encoding == Encoding::json;
    const Sender sender = sender_of(json, "tcp", peer.address(), peer.port());
    if (ec) continue;  // gone already
    if (!allowed(peer.address())) {
      refuse("address is not in poses.allow_from", sender);
      continue;  // closes it
    }
    if (!make_place()) {
      refuse("32 connections are open and busy already", sender);
      continue;
    }
    end_when_silent(socket, dead_after);
    auto connection = std::make_shared<Connection>(Connection{std::move(socket), sender});
    connections_.push_back(connection);
    asio::co_spawn(
        io_, [this, connection, json] { return json ? read_lines(connection) : read_requests(connection); },
        [this, connection](std::exception_ptr fault) {
          if (fault) say_fault(fault, connection->sender.id);
          connections_.remove(connection);
        });
  }
}

/// True when there is a place for one more connection, if need be that of the one silent for longest.
bool PoseServer::make_place() {
  if (connections_.size() < most_connections) return true;
  const auto longest =
      std::min_element(connections_.begin(), connections_.end(),
                       [](const ConnectionPointer& a, const ConnectionPointer& b) { return a->heard_at < b->heard_at; });
  if (Steady::now() - (*longest)->heard_at < silence_before_eviction) return false;
  std::uint64_t unsaid = 0;
  if (notices_.allows(LogLimiter::Clock::now(), unsaid))
    log_.info("pose connection closed: silent for longest, and its place was needed", {{"from", (*longest)->sender.id}});
  error_code ec;
  (*longest)->socket.close(ec);  // its coroutine ends by itself
  connections_.erase(longest);
  return true;
}

asio::awaitable<void> PoseServer::read_lines(ConnectionPointer connection) {
  control::LineParser lines;
  std::array<std::byte, 4096> buffer;
  while (!stopping_) {
    error_code ec;
    const std::size_t n = co_await connection->socket.async_read_some(asio::buffer(buffer), into(ec));
    if (ec || stopping_) co_return;
    connection->heard_at = Steady::now();
    lines.feed(std::span(buffer).first(n));
    while (const auto line = lines.next())
      line->too_long ? refuse("line is longer than 4096 bytes", connection->sender) : on_line(line->text, connection->sender);
  }
}

control::Response PoseServer::respond(Connection& connection, control::BytesView message, bool& close) {
  using control::StatusCode;
  const auto request = control::decode_request(message);
  if (!request) {
    refuse(request.error().why, connection.sender);
    close = !connection.greeted;
    return {request.error().id, StatusCode::refused, request.error().why, false};
  }
  if (const auto* hello = std::get_if<control::Hello>(&request->op)) {
    const bool known = hello->protocol_version == control::protocol_version;
    close = !known;
    connection.greeted = known;
    if (known) log_.debug("control client", {{"from", connection.sender.id}, {"name", hello->name.substr(0, 64)}});
    return {request->id, known ? StatusCode::ok : StatusCode::refused,
            known ? "" : "protocol_version must be " + std::to_string(control::protocol_version), true};
  }
  if (!connection.greeted) {
    close = true;
    return {request->id, StatusCode::refused, "the first message must be a Hello", false};
  }
  if (const auto* sample = std::get_if<control::PoseSample>(&request->op)) {
    const std::string refusal = take(*sample, connection.sender);
    return {request->id, refusal.empty() ? StatusCode::ok : StatusCode::refused, refusal, false};
  }
  return {request->id, StatusCode::unsupported, "this version knows Hello, PoseUpdate and ObjectUpdate", false};
}

asio::awaitable<bool> PoseServer::answer(ConnectionPointer connection, control::Bytes message) {
  error_code ec;
  co_await asio::async_write(connection->socket, asio::buffer(message), into(ec));
  co_return !ec && !stopping_;
}

asio::awaitable<void> PoseServer::read_requests(ConnectionPointer connection) {
  control::DelimitedParser parser;
  std::vector<std::byte> buffer(16384);
  while (!stopping_) {
    error_code ec;
    const std::size_t n = co_await connection->socket.async_read_some(asio::buffer(buffer), into(ec));
    if (ec || stopping_) co_return;
    connection->heard_at = Steady::now();
    parser.feed(std::span(buffer).first(n));
    while (true) {
      const auto message = parser.next();
      if (!message) {
        refuse(message.error().text, connection->sender);
        co_return;
      }
      if (!*message) break;
      bool close = false;
      const control::Response response = respond(*connection, **message, close);
      const bool silent = response.id == 0 && response.code == control::StatusCode::ok && !response.hello;
      if (!silent && !co_await answer(connection, control::delimited(control::encode_response(response)))) co_return;
      if (close) co_return;
    }
  }
}

}  // namespace sonar
