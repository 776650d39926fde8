#include "daemon/poses/pose_server.hpp"

#include <array>
#include <vector>

#include "daemon/system/listen.hpp"
#include "protocol/control/control.hpp"
#include "protocol/control/json_pose.hpp"

namespace sonar {
namespace {

constexpr std::size_t most_connections = 32;
constexpr auto accept_pause = std::chrono::milliseconds(100);
constexpr std::chrono::milliseconds dead_after{30000};  // a sender whose computer answers nothing

Sender sender_of(bool json, const char* transport, const asio::ip::address& ip, std::uint16_t port) {
  const std::string encoding = json ? "json" : "protobuf";
  const std::string address = ip.to_string();
  return {encoding + " " + transport + " " + address + ":" + std::to_string(port), encoding + " " + address};
}

}  // namespace

PoseServer::PoseServer(asio::io_context& io, const PoseConfig& config, PoseIntake& intake, Log& log)
    : io_(io), config_(config), intake_(intake), log_(log), connections_(most_connections) {}

Result<Endpoint> PoseServer::open(Listener& listener, Endpoint at) {
  if (listener.encoding == Encoding::json) {
    if (auto r = listen_tcp(listener.acceptor, at); !r) return tl::make_unexpected(r.error());
    at.port = listener.acceptor.local_endpoint().port();  // for port 0: the same number for both
  }
  if (auto r = bind_udp(listener.datagrams, at, false); !r) return tl::make_unexpected(r.error());
  at.port = listener.datagrams.local_endpoint().port();
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
    if (l.encoding == Encoding::json) keep_accepting(l);
  }
}

void PoseServer::say_fault(const std::exception_ptr& fault, const std::string& at) {
  sonar::say_fault(log_, faults_, text_of(fault), {"at", at});
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
  connections_.close_all();
}

// ---- what arrives

void PoseServer::on_line(const std::string& text, const Sender& sender) {
  if (const auto sample = control::parse_json_pose(text))
    intake_.take(*sample, sender);
  else
    intake_.refuse(sample.error().text, sender);
}

void PoseServer::on_datagram(Encoding encoding, std::span<const std::byte> bytes, const udp::endpoint& from) {
  const Sender sender = sender_of(encoding == Encoding::json, "udp", from.address(), from.port());
  if (encoding == Encoding::json) {  // a datagram holds whole lines; the last may lack its newline
    control::LineParser lines;
    lines.feed(bytes);
    lines.feed(std::array{std::byte{'\n'}});
    while (const auto line = lines.next())
      line->too_long ? intake_.refuse("line is longer than 4096 bytes", sender) : on_line(line->text, sender);
    return;
  }
  if (const auto sample = control::decode_pose_datagram(bytes))
    intake_.take(*sample, sender);
  else
    intake_.refuse(sample.error().text, sender);
}

asio::awaitable<void> PoseServer::receive(Listener& listener) {
  std::vector<std::byte> buffer(65536);
  while (!stopping_) {
    error_code ec;
    udp::endpoint from;
    const std::size_t n = co_await listener.datagrams.async_receive_from(asio::buffer(buffer), from, into(ec));
    if (stopping_) co_return;
    if (ec) continue;  // an ICMP answer to nothing we sent
    if (!is_admitted(config_.allow_from, from.address())) {
      intake_.refuse("address is not in poses.allow_from", sender_of(false, "udp", from.address(), from.port()));
      continue;
    }
    on_datagram(listener.encoding, std::span(buffer).first(n), from);
  }
}

// ---- JSON lines by TCP

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
    admit(std::move(socket));
  }
}

void PoseServer::admit(tcp::socket socket) {
  error_code ec;
  const auto peer = socket.remote_endpoint(ec);
  if (ec) return;  // gone already
  const Sender sender = sender_of(true, "tcp", peer.address(), peer.port());
  if (!is_admitted(config_.allow_from, peer.address()))
    return intake_.refuse("address is not in poses.allow_from", sender);  // closes it
  const bool room = connections_.make_room([this](const Connection& evicted) {
    say_at_times(log_, notices_, LogLevel::info, "pose connection closed: silent for longest, and its place was needed",
                 {{"from", evicted.sender.id}});
  });
  if (!room) return intake_.refuse(std::to_string(most_connections) + " connections are open and busy already", sender);
  end_when_silent(socket, dead_after);
  auto connection = std::make_shared<Connection>(Connection{std::move(socket), sender});
  connections_.add(connection);
  asio::co_spawn(
      io_, [this, connection] { return read_lines(connection); },
      [this, connection](std::exception_ptr fault) {
        if (fault) say_fault(fault, connection->sender.id);
        connection->close();
        connections_.remove(connection);
      });
}

asio::awaitable<void> PoseServer::read_lines(ConnectionPointer connection) {
  control::LineParser lines;
  std::array<std::byte, 4096> buffer;
  while (!stopping_) {
    error_code ec;
    const std::size_t n = co_await connection->socket.async_read_some(asio::buffer(buffer), into(ec));
    if (ec || stopping_) co_return;
    connection->heard_at = std::chrono::steady_clock::now();
    lines.feed(std::span(buffer).first(n));
    while (const auto line = lines.next()) {
      if (line->too_long)
        intake_.refuse("line is longer than 4096 bytes", connection->sender);
      else
        on_line(line->text, connection->sender);
    }
  }
}

}  // namespace sonar
