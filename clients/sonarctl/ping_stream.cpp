#include "clients/sonarctl/ping_stream.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "core/base/regular_file.hpp"
#include "core/text/format.hpp"
#include "core/text/ipv4.hpp"

namespace sonar::clients {
namespace {

using namespace std::chrono_literals;
using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;
using Kind = protocol::HostPort::Kind;

constexpr auto probe_patience = 300ms;         // for each make, while the make is unknown
constexpr auto answer_patience = 3000ms;       // minimum once a sonar has answered, because it may be computing
constexpr auto connect_patience = 2000ms;      // for streams, before other kinds of ports are tried
constexpr auto probe_after = 500ms;            // without a datagram; a restart of sonard takes longer
constexpr auto longest_pause = 160ms;          // between attempts
constexpr auto leave_patience = 1000ms;        // for the sonar to close the connection too
constexpr auto lost_patience = 200ms;          // for the answers of a sonar that has probably gone
constexpr int receive_buffer_bytes = 4 << 20;  // a few pings
constexpr const char* is_sonard_there = ". Is sonard running there? Its banner names the address of each sonar";

/// Returns the time in the form that hosts expect.
Time now() { return Time(std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch())); }

milliseconds left_until(Clock::time_point deadline) {
  return std::max(0ms, std::chrono::ceil<milliseconds>(deadline - Clock::now()));
}

Wanted nothing_wanted() {
  Wanted nothing;
  nothing.as_it_is = true;
  return nothing;
}

bool is_over(const Result<PingStream>& stream) { return stream || stream.error().kind == ErrorKind::usage; }

}  // namespace

const Make* make_at(std::uint16_t port) {
  for (const Make& make : protocol::makes())
    if (make.ports.front().number == port) return &make;
  return nullptr;
}

Result<PingStream> PingStream::open(const Endpoint& device, const Make* make, const Wanted& wanted, milliseconds patience,
                                    bool keeps_messages, Rejection* rejection) {
  const auto deadline = Clock::now() + patience;
  using Candidate = std::pair<const Make*, Endpoint>;
  std::vector<Candidate> streams, others;
  for (const Make& one : protocol::makes()) {
    // Without a given make, only the first of the makes that share a port is tried.
    if (make != nullptr ? make != &one : make_at(one.ports.front().number) != &one) continue;
    const Endpoint at{device.host, make != nullptr && device.port != 0 ? device.port : one.ports.front().number};
    (one.ports.front().kind == Kind::tcp ? streams : others).emplace_back(&one, at);
  }
  const auto started = [&](const Candidate& at, Result<std::unique_ptr<protocol::Host>> host, std::optional<Socket> connected,
                           milliseconds within) -> Result<PingStream> {
    if (!host) return tl::unexpected(host.error());
    PingStream stream(*at.first, at.second, *std::move(host), keeps_messages);
    const Result<void> opened = stream.start(std::move(connected), within);
    if (rejection != nullptr && stream.is_turned_away_) *rejection = {at.first, at.second};
    if (!opened) return tl::unexpected(opened.error());
    return stream;
  };
  // A make without the requested settings is tried without them; the error about the settings is reported only if it answers.
  const auto searched = [&](const Candidate& at, milliseconds within) -> Result<PingStream> {
    auto host = at.first->host(wanted);
    if (host) return started(at, std::move(host), std::nullopt, within);
    const auto stream = started(at, at.first->host(nothing_wanted()), std::nullopt, within);
    return tl::unexpected(is_over(stream) ? host.error() : stream.error());
  };
  if (make != nullptr)
    if (auto host = make->host(wanted); !host) return tl::unexpected(host.error());  // checked before connecting to the sonar
  Error failed;
  auto pause = 20ms;
  for (bool is_last = false;;
       is_last = Clock::now() >= deadline) {  // tries streams once more, because the other kinds may have needed much time
    if (!streams.empty()) {
      std::vector<Endpoint> places;
      for (const auto& [one, at] : streams) places.push_back(at);
      auto connected =
          connect_first(places, others.empty() ? left_until(deadline) : std::min(left_until(deadline), connect_patience));
      if (connected) {
        const Candidate& at = streams[connected->which];
        return started(at, at.first->host(wanted), std::move(connected->socket), std::max(patience, answer_patience));
      }
      failed = connected.error();
      if (failed.kind == ErrorKind::usage) return tl::unexpected(failed);
    }
    if (interrupted != 0) return failure(ErrorKind::io, "interrupted before " + device.host + " answered");
    if (is_last) {
      const std::string silent = text::joined(others, ", ", [](const Candidate& at) {
        return (at.first->ports.front().kind == Kind::http ? "http " : "udp ") + text_from(at.second);
      });
      if (make == nullptr && !silent.empty())
        failed.text += ". No sonar answered at " + silent + " either; on a busy computer, name the make (--make)";
      return tl::unexpected(failed);
    }
    for (const Candidate& candidate : others) {
      const bool by_http = candidate.first->ports.front().kind == Kind::http;
      auto within = make != nullptr ? std::max(left_until(deadline), 1ms) : probe_patience;
      if (by_http) {
        if (make == nullptr && !connect_first({candidate.second}, probe_patience)) continue;
        within = std::max(patience, answer_patience);
      }
      auto stream = searched(candidate, within);
      if (is_over(stream) || (by_http && make != nullptr)) return stream;  // in a search, this may be another web server
      if (streams.empty()) failed = stream.error();
    }
    ::poll(nullptr, 0, static_cast<int>(pause.count()));  // because a port that refuses answers at once
    pause = std::min(2 * pause, longest_pause);
  }
}

/// Waits until the sonar closes the connection too: a close with unread bytes would reset it, and lose the last messages.
PingStream::~PingStream() {
  if (host_ == nullptr || !is_started_) return;
  protocol::HostActions last = host_->on_leave();
  if (last.empty()) return;
  ended_.reset();  // the connection may be usable although the command has failed
  carry_out(std::move(last));
  for (const auto until = Clock::now() + (is_lost_ ? lost_patience : answer_patience);
       !host_->has_left() && !ended_ && Clock::now() < until;)
    receive(left_until(until));
  const auto until = Clock::now() + (is_lost_ ? lost_patience : leave_patience);
  for (std::size_t port = 0; port < sockets_.size() && !ended_; ++port) {
    if (make_->ports[port].kind != Kind::tcp || !sockets_[port]) continue;
    ::shutdown(sockets_[port]->fd(), SHUT_WR);
    for (pollfd ready{sockets_[port]->fd(), POLLIN, 0}; Clock::now() < until;) {
      if (::poll(&ready, 1, static_cast<int>(left_until(until).count())) < 0 && errno == EINTR) continue;
      if (::recv(ready.fd, chunk_.data(), chunk_.size(), MSG_DONTWAIT) <= 0) break;
    }
  }
}

Result<Socket> PingStream::open_port(std::size_t port, milliseconds patience) {
  const protocol::HostPort& wanted = make_->ports[port];
  if (wanted.kind == Kind::tcp) return connect_tcp({device_.host, port == 0 ? device_.port : wanted.number}, patience);
  const auto towards = connect_udp({device_.host, port == 0 ? device_.port : wanted.number});
  const bool in_group = wanted.group != protocol::Ipv4{};
  auto socket = wanted.kind == Kind::udp
                    ? connect_udp({device_.host, port == 0 ? device_.port : wanted.number})
                    : listen_udp(Endpoint{in_group ? text::format_ipv4(wanted.group) : "0.0.0.0", wanted.number});
  if (!socket) return socket;
  ::setsockopt(socket->fd(), SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
  if (!in_group) return socket;
  if (!towards) return tl::unexpected(towards.error());
  ip_mreq membership{};
  ::inet_pton(AF_INET, text::format_ipv4(wanted.group).c_str(), &membership.imr_multiaddr);
  membership.imr_interface = own_address(*towards).sin_addr;  // the interface that reaches the device
  if (::setsockopt(socket->fd(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0)
    return failure(ErrorKind::unavailable, std::string("cannot join the sonar's multicast group: ") + std::strerror(errno));
  return socket;
}

Result<void> PingStream::start(std::optional<Socket> connected, milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  answer_patience_ = patience;
  const auto towards = connect_udp(device_);
  if (!towards) return tl::unexpected(towards.error());
  device_ip_ = peer_address(*towards).sin_addr.s_addr;
  std::vector<std::uint16_t> own;
  for (std::size_t port = 0; port < make_->ports.size(); ++port) {
    sockets_.emplace_back(port == 0 ? std::move(connected) : std::nullopt);
    if (make_->ports[port].kind != Kind::http && !sockets_.back()) {
      auto socket = open_port(port, patience);
      if (!socket) return tl::unexpected(socket.error());
      sockets_.back() = *std::move(socket);
    }
    own.push_back(sockets_.back() ? ntohs(own_address(*sockets_.back()).sin_port) : std::uint16_t{0});
  }
  carry_out(host_->on_open(own, now()));
  while (!host_->is_open() && !ended_ && interrupted == 0 && Clock::now() < deadline)
    receive(std::min<milliseconds>(left_until(deadline), longest_step));
  const std::optional<Error> why = std::exchange(ended_, std::nullopt);
  is_started_ = host_->is_open() && !why;
  if (is_started_) return {};
  if (interrupted != 0) return failure(ErrorKind::io, "interrupted before " + place() + " answered");
  if (!why || why->kind == ErrorKind::unavailable)
    return failure(ErrorKind::unavailable,
                   place() + " does not answer as " + std::string(make_->title) + " does" + is_sonard_there);
  if (why->kind != ErrorKind::io) return tl::unexpected(*why);
  is_turned_away_ = !has_answered_ && make_->ports.front().kind == Kind::tcp;
  return failure(ErrorKind::io,
                 place() + (has_answered_ ? " closed the connection before it took the settings: the daemon stopped, "
                                            "or closed it; see its log"
                                          : " closed the connection before it answered: all its client slots are "
                                            "taken (clients.max)"));
}

void PingStream::carry_out(protocol::HostActions actions) {
  std::vector<std::string> notices;
  for (protocol::HostAction& action : actions) {
    if (ended_) return;
    if (const auto* send = std::get_if<protocol::HostSend>(&action)) {
      if (send->port >= sockets_.size() || !sockets_[send->port])
        ended_ = Error{ErrorKind::io, "is sent bytes at a port that is not open"};
      else if (const auto sent = write_all(*sockets_[send->port], send->bytes); !sent)
        ended_ = sent.error();
      else
        keep(send->port, recording::Origin::client, send->bytes);
    } else if (const auto* ask = std::get_if<protocol::ResourceRequest>(&action)) {
      const auto reply = http_ask(device_, ask->method, ask->path, ask->body, answer_patience_);
      if (!reply)
        ended_ = reply.error();
      else
        carry_out(host_->on_reply({.status = reply->status, .body = reply->body}, now()));
    } else if (auto* ping = std::get_if<HostPing>(&action)) {
      const std::string limits = text::joined(ping->limited, "; ");
      if (limits != std::exchange(limits_, limits) && !limits.empty())
        notices.push_back("the sonar limits the request: " + limits);
      items_.push_back({Wait::data, std::move(*ping), std::exchange(notices, {}), std::exchange(kept_, {}), {}});
    } else if (auto* notice = std::get_if<protocol::Notice>(&action)) {
      notices.push_back(std::move(notice->text));
    } else if (auto* error = std::get_if<Error>(&action)) {
      ended_ = std::move(*error);
      ended_by_host_ = true;
      if (ended_->kind != ErrorKind::usage) ended_->text = place() + " " + ended_->text;
    }
  }
  if (!notices.empty()) items_.push_back({Wait::data, {}, std::move(notices), std::exchange(kept_, {}), {}});
}

bool PingStream::receive(milliseconds patience) {
  if (const auto tick = host_->next_tick()) patience = std::clamp(std::chrono::ceil<milliseconds>(*tick - now()), 0ms, patience);
  if (make_->is_by_udp()) patience = std::min(patience, left_until(probe_at_));
  std::vector<pollfd> ready;
  for (const auto& socket : sockets_) ready.push_back({socket ? socket->fd() : -1, POLLIN, 0});
  const int polled = ::poll(ready.data(), ready.size(), static_cast<int>(patience.count()));
  if (polled < 0) {
    if (errno != EINTR) ended_ = Error{ErrorKind::io, std::strerror(errno)};
    return ended_.has_value();
  }
  if (make_->is_by_udp()) probe(polled == 0);
  for (std::size_t port = 0; port < ready.size() && !ended_; ++port)
    if (ready[port].revents != 0) read_port(port);
  if (!ended_) carry_out(host_->on_tick(now()));
  return true;
}

void PingStream::probe(bool is_silent) {
  if (is_silent && Clock::now() < probe_at_) return;
  if (is_silent && ::send(sockets_.front()->fd(), nullptr, 0, MSG_NOSIGNAL) < 0)
    ended_ = Error{ErrorKind::unavailable, std::strerror(errno)};
  probe_at_ = Clock::now() + probe_after;
}

void PingStream::read_port(std::size_t port) {
  std::size_t size = 0;
  if (make_->ports[port].kind == Kind::tcp) {
    const Read read = read_some(*sockets_[port], chunk_, 0ms);
    if (read.what == Wait::closed) ended_ = Error{ErrorKind::io, read.error};
    size = read.size;
  } else {
    const Datagram datagram = receive_from(*sockets_[port], chunk_, 0ms);
    if (datagram.what == Wait::closed) ended_ = Error{ErrorKind::unavailable, datagram.error};
    size = datagram.ip == device_ip_ ? datagram.size : 0;  // ignore datagrams from other senders
  }
  if (size == 0) return;
  has_answered_ = has_answered_ || port == 0;
  const auto received = std::span<const std::byte>(chunk_).first(size);
  if (record_.is_open() && port == 0) {
    for (const std::byte b : received) record_.put(static_cast<char>(b));
    if (!record_.flush()) {
      ended_ = Error{ErrorKind::io, "cannot write more to " + raw_file_.string() + ": " + why_not_written(raw_file_, errno)};
      record_.close();       // the destructor continues to receive
      take(port, received);  // an answer among the bytes may be necessary to put back settings
      return;
    }
  }
  const auto messages = [this] { return host_->counts().value_or(protocol::Host::Counts{}).messages; };
  const auto before = messages();
  const std::size_t items = items_.size();
  take(port, received);
  const bool has_more = messages() > before || !kept_.empty();
  if (has_more && items_.size() == items) items_.push_back({Wait::data, {}, {}, std::exchange(kept_, {}), {}});
}

/// If messages are kept, the host gets them one by one, so that each is listed before the ping that it completes.
void PingStream::take(std::size_t port, std::span<const std::byte> bytes) {
  const auto give = [&](std::span<const std::byte> message) {
    keep(port, recording::Origin::device, message);
    carry_out(host_->on_bytes(port, message, now()));
  };
  const auto splitter = splitters_.find(port);
  if (splitter == splitters_.end()) return give(bytes);
  splitter->second.append({}, bytes);
  carry_out(host_->on_bytes(port, {}, now()));  // shows the host that the port is active, even if no message is complete yet
  while (const auto message = splitter->second.next()) give(message->bytes);
}

void PingStream::keep(std::size_t port, recording::Origin from, std::span<const std::byte> bytes) {
  if (!keeps_) return;
  const bool by_tcp = make_->ports[port].kind == Kind::tcp;
  kept_.push_back(
      {unix_time_.now(), from, by_tcp ? recording::Carrier::stream : recording::Carrier::datagram, {bytes.begin(), bytes.end()}});
}

recording::PcapConversation PingStream::conversation() const {
  const auto end_from = [](const sockaddr_in& at) { return recording::IpEnd{ntohl(at.sin_addr.s_addr), ntohs(at.sin_port)}; };
  recording::PcapConversation ends;
  ends.device = {ntohl(device_ip_), device_.port};
  ends.status_from.address = ends.device.address;
  if (const auto* const beacon = make_->device->port(protocol::Port::Kind::udp_beacon))
    ends.status_from.port = ends.status_to.port = beacon->number;
  if (const auto towards = connect_udp(device_)) ends.client.address = end_from(own_address(*towards)).address;
  for (std::size_t port = 0; port < sockets_.size(); ++port) {
    const protocol::HostPort& of = make_->ports[port];
    if (!sockets_[port]) continue;
    const recording::IpEnd own = end_from(own_address(*sockets_[port]));
    if (of.kind == Kind::tcp) {
      ends.client = own;
      continue;
    }
    ends.status_from.port = port == 0 ? device_.port : own.port;
    ends.status_to = {of.group != protocol::Ipv4{} ? text::number_from_ipv4(of.group) : ends.client.address, own.port};
  }
  return ends;
}

PingStream::Item PingStream::next(milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  for (;;) {
    if (items_.empty() && !ended_) carry_out(host_->on_demand(now()));
    if (!items_.empty()) {
      Item item = std::move(items_.front());
      items_.pop_front();
      return item;
    }
    if (ended_)
      return {Wait::closed, {}, {}, std::exchange(kept_, {}), ended_->text, ended_->kind, record_.fail(), ended_by_host_};
    if (!receive(left_until(deadline))) return {Wait::interrupted, {}, {}, {}, {}};
    if (items_.empty() && !ended_ && Clock::now() >= deadline) return {};
  }
}

bool PingStream::is_rejected(milliseconds patience) const {
  if (make_->ports.front().kind != Kind::tcp || has_answered_) return false;
  std::vector<int> others;  // some sonars send their pings only to these ports
  for (std::size_t port = 1; port < sockets_.size(); ++port)
    if (sockets_[port]) others.push_back(sockets_[port]->fd());
  return ends_without_a_byte(*sockets_.front(), others, patience);
}

std::string PingStream::own() const {
  if (!sockets_.front()) return {};
  const sockaddr_in at = own_address(*sockets_.front());
  return text_from({text::format_ipv4(text::ipv4_from_number(ntohl(at.sin_addr.s_addr))), ntohs(at.sin_port)});
}

Result<void> PingStream::record_to(const std::filesystem::path& file) {
  if (make_->ports.size() != 1 || make_->ports.front().kind != Kind::tcp)
    return failure(ErrorKind::usage, "only pings that come over TCP are recorded as raw bytes; this is " + about());
  if (make_->each_ping_requested)  // a recording would begin after the greeting, without which its pings are not readable
    return failure(ErrorKind::usage, "only sonars that send pings without a request are recorded as raw bytes; this is " +
                                         about() + ": sonarctl record keeps the messages of both ends");
  const int opened = open_to_write(file, O_CREAT);  // std::ofstream would wait for the reader of a pipe
  const int error = errno;
  if (opened < 0) return failure(ErrorKind::io, "cannot write " + file.string() + ": " + why_not_written(file, error));
  record_.open(file, std::ios::binary | std::ios::trunc);
  raw_file_ = file;
  ::close(opened);
  if (!record_) return failure(ErrorKind::io, "cannot write " + file.string() + ": check that its folder exists and is writable");
  return {};
}

Result<Discovered> discover(milliseconds patience) {
  const auto makes = protocol::makes();
  const auto make = std::find_if(makes.begin(), makes.end(), [](const Make& one) { return one.announced != nullptr; });
  const std::uint16_t port = make->device->port(protocol::Port::Kind::udp_beacon)->number;
  auto socket = listen_udp(port);
  if (!socket) return tl::unexpected(socket.error());
  const auto deadline = Clock::now() + patience;
  for (;;) {
    std::array<std::byte, 2048> datagram;
    const Read read = read_some(*socket, datagram, left_until(deadline));
    if (read.what != Wait::data)
      return failure(ErrorKind::unavailable, "no status datagram on udp " + std::to_string(port) +
                                                 ": is a sonar running, and does its status_to reach this machine?");
    const auto announced = make->announced(std::span<const std::byte>(datagram).first(read.size));
    if (announced) return Discovered{{text::format_ipv4(announced->address), make->ports.front().number}, *announced};
  }
}

}  // namespace sonar::clients
