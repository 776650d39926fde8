#include "daemon/server/poses/pose_server.hpp"

#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "daemon/server/system/listen.hpp"
#include "protocol/control/control.hpp"

namespace sonar {
namespace {

constexpr std::size_t most_connections = 32;
constexpr std::size_t most_lines_of_a_datagram = 64;
constexpr std::size_t work_of_a_turn = 4096;  // bytes processed before other connections have their turn
constexpr std::size_t least_work = 64;        // cost of a read or of a line [bytes], in addition to its bytes
constexpr int most_not_json = 8;  // limit of successive lines that are too long or not JSON, after which the connection ends
constexpr std::size_t dropped_per_s = 1024u << 20;      // limit of discarded bytes; 32 floods keep 0.1 to 1 GB in the kernel
constexpr std::chrono::milliseconds between_looks{10};  // pause before new input is read
constexpr std::chrono::milliseconds longest_wait{100};  // limit for poses that wait in the kernel
constexpr int most_tries = 16;  // for port 0, because the number that the system chooses for TCP may be in use for UDP
constexpr const char* no_json = "not JSON: this port accepts poses as lines of JSON";

std::size_t waiting_bytes(tcp::socket& socket) {
  int waiting = 0;
  return ::ioctl(socket.native_handle(), FIONREAD, &waiting) == 0 && waiting > 0 ? static_cast<std::size_t>(waiting) : 0;
}

Sender sender_of(bool json, const char* transport, const asio::ip::address& ip, std::uint16_t port) {
  const std::string encoding = json ? "json" : "protobuf";
  const std::string address = ip.to_string();
  return {encoding + " " + transport + " " + address + ":" + std::to_string(port), encoding + " " + address};
}

}  // namespace

PoseServer::PoseServer(asio::io_context& io, const PoseConfig& config, const LimitConfig& limits, Admission& admission,
                       PoseIntake& intake, Log& log)
    : io_(io),
      config_(config),
      limits_(limits),
      admission_(admission),
      intake_(intake),
      log_(log),
      connections_(most_connections, std::chrono::seconds(1), [](const Connection& c) { return c.sender.source; }),
      together_(limits.pose_bytes_per_s),
      dropping_(dropped_per_s) {}

Result<Endpoint> PoseServer::open(Port& port, Endpoint at) {
  if (port.encoding == Encoding::json) {
    if (auto r = port.lines.open(at); !r) return tl::make_unexpected(r.error());
    at = port.lines.at();  // if port 0 was configured, UDP gets the number of TCP
  }
  if (auto r = bind_udp(port.datagrams, at, false); !r) return tl::make_unexpected(r.error());
  at.port = port.datagrams.local_endpoint().port();
  return at;
}

Result<void> PoseServer::open() {
  const auto add = [this](Encoding encoding, const PoseListener& wanted, Endpoint& out) -> Result<void> {
    if (!wanted.enabled) return {};
    Result<Endpoint> at;
    for (int tries = wanted.at.port == 0 ? most_tries : 1; tries > 0; --tries) {
      at = open(ports_.emplace_back(encoding, udp::socket(io_), io_, admission_), wanted.at);
      if (at) break;
      ports_.pop_back();
    }
    if (!at) {
      const std::string key = encoding == Encoding::json ? "poses.json" : "poses.protobuf";
      return failure(at.error().kind, at.error().text + "; " + key + " in the configuration can set another address, or off");
    }
    out = *at;
    return {};
  };
  if (auto r = add(Encoding::protobuf, config_.protobuf, protobuf_at_); !r) return r;
  return add(Encoding::json, config_.json, json_at_);
}

void PoseServer::start() {
  for (Port& port : ports_) {
    keep_running(
        io_.get_executor(), [this, &port] { return receive(port); },
        [this](const std::string& fault) {
          if (!stopping_) log_fault(fault, "pose datagrams");
          return !stopping_;
        });
    port.lines.start([this](tcp::socket socket) { admit(std::move(socket)); },
                     [this](const std::string& fault) { log_fault(fault, "pose connections"); });
  }
}

void PoseServer::log_fault(const std::string& fault, const std::string& at) {
  sonar::log_fault(log_, faults_, fault, {"at", at});
}

void PoseServer::stop() {
  stopping_ = true;
  error_code ec;
  for (Port& port : ports_) {
    port.datagrams.close(ec);
    port.lines.stop();
  }
  connections_.close_all();
}

// ---- what arrives

/// Passes a line on as a pose. Lines that are too long or not JSON objects count against the connection.
PoseServer::LineKind PoseServer::on_line(const control::LineParser::Line& line, const Sender& sender) {
  if (line.too_long) {
    intake_.refuse("line is longer than 4096 bytes", sender);
    return LineKind::not_json;
  }
  const auto sample = control::parse_json_pose(line.text);
  if (sample) return intake_.take(*sample, sender).empty() ? LineKind::pose : LineKind::other_object;
  intake_.refuse(sample.error().text, sender);
  return control::is_json_object(line.text) ? LineKind::other_object : LineKind::not_json;
}

void PoseServer::on_datagram(Encoding encoding, std::span<const std::byte> bytes, const udp::endpoint& from) {
  const Sender sender = sender_of(encoding == Encoding::json, "udp", from.address(), from.port());
  if (encoding == Encoding::json) {  // a datagram contains whole lines; the last newline may be missing
    control::LineParser lines;
    lines.feed(bytes);
    lines.feed(std::array{std::byte{'\n'}});
    for (std::size_t taken = 0; const auto line = lines.next(); ++taken) {
      if (taken == most_lines_of_a_datagram) return intake_.refuse("a datagram has at most 64 lines; the rest is lost", sender);
      on_line(*line, sender);
    }
    return;
  }
  if (const auto sample = control::decode_pose_datagram(bytes))
    intake_.take(*sample, sender);
  else
    intake_.refuse(sample.error().text, sender);
}

/// Returns the work of a datagram: its bytes and, for each pose that it may contain, the cost of a line.
std::size_t PoseServer::work_of(Encoding encoding, std::span<const std::byte> datagram) {
  const auto lines = encoding == Encoding::json ? std::count(datagram.begin(), datagram.end(), std::byte{'\n'}) : 0;
  return datagram.size() + (1 + std::min<std::size_t>(static_cast<std::size_t>(lines), most_lines_of_a_datagram)) * least_work;
}

asio::awaitable<void> PoseServer::receive(Port& port) {
  std::vector<std::byte> buffer(65536);
  asio::steady_timer pause(io_);
  while (!stopping_) {
    error_code ec;
    udp::endpoint from;
    const std::size_t n = co_await port.datagrams.async_receive_from(asio::buffer(buffer), from, into(ec));
    if (stopping_) co_return;
    if (ec) continue;  // the error is an ICMP answer; this socket sends nothing
    if (!is_admitted(config_.allow_from, from.address())) {
      intake_.refuse("address is not in poses.allow_from", sender_of(false, "udp", from.address(), from.port()));
      continue;
    }
    const auto datagram = std::span(buffer).first(n);
    const auto now = std::chrono::steady_clock::now();
    const bool taken =
        of_address_.takes(from.address().to_string(), work_of(port.encoding, datagram), limits_.input_bytes_per_s, now);
    if (taken)
      on_datagram(port.encoding, datagram, from);
    else
      intake_.refuse("more than limits.input_bytes_per_s was sent", sender_of(false, "udp", from.address(), from.port()));
    const auto wait = port.rate.pause_after(taken, now);
    if (wait.count() == 0) continue;
    pause.expires_after(wait);  // a few milliseconds
    co_await pause.async_wait(into(ec));
  }
}

// ---- JSON lines over TCP

/// Checks in this order: the address is allowed, descriptors are available, a slot is free or can be taken from a less active
/// sender.
void PoseServer::admit(tcp::socket socket) {
  error_code ec;
  const auto peer = socket.remote_endpoint(ec);
  if (ec) return;  // the sender has disconnected already
  const Sender sender = sender_of(true, "tcp", peer.address(), peer.port());
  if (!is_admitted(config_.allow_from, peer.address()))
    return intake_.refuse("address is not in poses.allow_from", sender);  // the destructor closes the socket
  connections_.forget_if([](Connection& c) { return has_left(c.socket); });
  const auto say_evicted = [this](const Connection& evicted) {
    log_limited(log_, notices_, LogLevel::info, "pose connection closed to make room: it was idle or over its limit for longest",
                {{"from", evicted.sender.id}});
  };
  if (admission_.is_drivers(socket)) connections_.evict(sender.source, say_evicted);
  const bool room = connections_.make_room(sender.source, say_evicted);
  if (!room) return intake_.refuse(std::to_string(most_connections) + " connections are open and busy already", sender);
  end_when_silent(socket, limits_.dead_peer);
  auto connection = std::make_shared<Connection>(std::move(socket), sender, limits_.input_bytes_per_s,
                                                 together_.join(limits_.pose_bytes_per_s));
  connections_.add(connection);
  asio::co_spawn(
      io_, [this, connection] { return read_lines(connection); },
      [this, connection](std::exception_ptr fault) {
        if (fault) log_fault(text_of(fault), connection->sender.id);
        connection->close();
        connections_.remove(connection);
      });
}

/// Reads at most work_of_a_turn bytes in each turn, then lets other connections proceed. If a sender has disconnected with more
/// waiting input than its limits allow, only its last pose is applied.
asio::awaitable<void> PoseServer::read_lines(ConnectionPointer connection) {
  Connection& c = *connection;
  std::array<std::byte, work_of_a_turn> buffer;
  error_code ec;
  while (true) {
    const bool was_empty = waiting_bytes(c.socket) == 0;
    const std::size_t n = co_await c.socket.async_read_some(asio::buffer(buffer), into(ec));
    if (ec || stopping_) co_return;
    if (was_empty) c.kept_up_at = std::chrono::steady_clock::now();
    c.lines.feed(std::span(buffer).first(n));
    Work work{n + least_work};
    for (Turn turn = Turn::not_over; turn == Turn::not_over; work = {}) {
      turn = take_turn(c, work);
      if (turn == Turn::end) co_return;
      const Rested rested = co_await rest(c, work);
      if (!c.socket.is_open() || stopping_) co_return;
      if (rested == Rested::leaves_much) co_return take_newest(c);
    }
  }
}

/// Processes lines of up to work_of_a_turn bytes and adds their cost to `work`.
PoseServer::Turn PoseServer::take_turn(Connection& c, Work& work) {
  for (std::size_t taken = 0; taken < work_of_a_turn;) {
    const auto line = c.lines.next();
    if (!line && c.lines.may_become_object()) return Turn::over;
    if (!line) intake_.refuse(no_json, c.sender);
    const LineKind kind = line ? on_line(*line, c.sender) : LineKind::not_json;
    c.not_json = kind == LineKind::not_json ? c.not_json + 1 : 0;
    if (c.not_json == most_not_json || (kind == LineKind::not_json && !(line && line->begins_object))) {
      log_limited(log_, notices_, LogLevel::warning, std::string("pose connection closed: ") + no_json, {{"from", c.sender.id}});
      return Turn::end;
    }
    taken += line->text.size() + least_work;
    work.bytes += least_work;
    work.has_pose |= kind == LineKind::pose;
  }
  return Turn::not_over;
}

/// Lets other connections proceed. The pause is longer if this connection is over its limit, or over its share of the common
/// limit.
asio::awaitable<PoseServer::Rested> PoseServer::rest(Connection& c, const Work& work) {
  const auto now = std::chrono::steady_clock::now();
  const auto pause = std::max(c.rate.pause_after(work.bytes, now), together_.pause_after(c.of_all, work.bytes, now));
  const bool pauses = pause.count() > 0;
  const bool within_limits = !drop_backlog(c, pauses) && !pauses;
  if (!within_limits) c.proved = false;
  if (work.has_pose && within_limits) {
    c.proved = true;
    c.active_at = now;
  }
  const auto until = now + pause;
  do {
    error_code ec;
    c.turn.expires_at(std::min(until, std::chrono::steady_clock::now() + between_looks));
    co_await c.turn.async_wait(into(ec));
    if (!c.socket.is_open() || stopping_) co_return Rested::goes_on;
    drop_backlog(c, pauses);
    if (std::chrono::steady_clock::now() >= until) co_return Rested::goes_on;
  } while (!has_left(c.socket));
  co_return Rested::leaves_much;
}

/// Applies only the last waiting pose of a closed connection, so that reconnecting gains nothing.
void PoseServer::take_newest(Connection& c) {
  std::optional<control::LineParser::Line> newest;
  std::array<std::byte, work_of_a_turn> buffer;
  error_code ec;
  for (std::size_t n = 0; !ec; n = c.socket.read_some(asio::buffer(buffer), ec)) {  // until the end of the stream
    c.lines.feed(std::span(buffer).first(n));
    while (auto line = c.lines.next()) newest = std::move(line);
  }
  if (newest) on_line(*newest, c.sender);
}

/// Drops all but the newest bytes that wait in the kernel: 0.1 s of the allowed rate are kept, or two lines if the sender is over
/// the limit, or if this computer has been too slow for 0.1 s. Otherwise old poses would act for seconds, because the sender's
/// kernel may have megabytes more, even after it has closed. Returns true if bytes were dropped.
bool PoseServer::drop_backlog(Connection& c, bool pauses) {
  const std::size_t waiting = waiting_bytes(c.socket);
  const auto now = std::chrono::steady_clock::now();
  constexpr std::size_t least = 2 * control::longest_line;
  const bool is_behind = now - c.kept_up_at > longest_wait || now < c.behind_until;
  if (waiting <= least) c.kept_up_at = now;
  if (waiting <= least || dropping_.left(now) == 0) return false;
  if (is_behind) c.behind_until = now + longest_wait;
  const std::size_t burst = pauses || is_behind ? 0 : std::min(limits_.input_bytes_per_s, together_.share()) / 10;
  const std::size_t kept = std::max(burst, least);
  if (waiting <= kept) return false;
  // The kernel frees the bytes without copying them (tcp(7), MSG_TRUNC).
  const ssize_t dropped = ::recv(c.socket.native_handle(), nullptr, waiting - kept, MSG_TRUNC | MSG_DONTWAIT);
  if (dropped <= 0) return false;
  dropping_.pause_after(static_cast<std::size_t>(dropped), now);
  c.lines.skip_gap();
  intake_.refuse(
      "older poses that waited, because more than limits.input_bytes_per_s or a share of limits.pose_bytes_per_s was sent",
      c.sender);
  return true;
}

}  // namespace sonar
