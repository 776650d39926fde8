// A replay server and a driver on loopback, for the tests of replay.
#pragma once

#include <gtest/gtest.h>
#include <poll.h>

#include <future>

#include "daemon/commands/replay/replay_server.hpp"

namespace sonar {

using recording::Bytes;
using recording::Carrier;
using recording::Origin;
using recording::RecordedMessage;
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;
constexpr milliseconds patience{20000};
constexpr std::size_t everything = ~std::size_t{0};

const inline Ipv4 address{127, 0, 0, 2};

/// A replay server in a thread of its own.
class Replay {
 public:
  Replay(Bytes file, ReplayOptions options) : log_(quiet()) {
    auto opened = recording::open_recording(recording::source_from("recording", std::move(file)));
    if (!opened) throw std::runtime_error(opened.error().text);
    recording_ = std::move(*opened);
    auto device = find_replay_device(*recording_.reader, "recording", 1042);
    if (!device) throw std::runtime_error(device.error().text);
    options.at = {address, 0};
    server_ = std::make_unique<ReplayServer>(io_, *recording_.reader, *device, options, log_);
    if (const auto listening = server_->open(); !listening) throw std::runtime_error(listening.error().text);
    server_->start();
    done_ = std::async(std::launch::async, [this] { io_.run(); });
  }
  ~Replay() {
    stop();
    done_.wait();
  }
  void stop() {
    asio::post(io_, [this] { server_->stop(); });
  }
  bool ends() { return done_.wait_for(patience) == std::future_status::ready; }
  tcp::endpoint at() const { return {asio::ip::address_v4(server_->at().ip), server_->at().port}; }
  /// Call it only after the end of the replay.
  const ReplayServer::Figures& figures() const { return server_->figures(); }

 private:
  static LogOptions quiet() {
    LogOptions options;
    options.sink = [](LogLevel, const std::string&) {};
    return options;
  }
  Log log_;
  asio::io_context io_;
  recording::Recording recording_;
  std::unique_ptr<ReplayServer> server_;
  std::future<void> done_;
};

/// Waits with a time limit, which Asio's receive does not have. Returns true if bytes came or the stream ended.
template <class Socket>
bool readable(Socket& socket) {
  pollfd waited{socket.native_handle(), POLLIN, 0};
  return ::poll(&waited, 1, static_cast<int>(patience.count())) > 0;
}

class Driver {
 public:
  explicit Driver(const Replay& replay) : socket_(io_) { socket_.connect(replay.at()); }
  /// Returns up to `most` bytes; fewer if the stream ends earlier.
  Bytes read(std::size_t most) {
    Bytes bytes, block(1 << 16);
    error_code ec;
    while (!ec && bytes.size() < most) {
      if (!readable(socket_)) {
        ADD_FAILURE() << "no byte from the replay for " << patience.count() << " ms";
        break;
      }
      const std::size_t n = socket_.read_some(asio::buffer(block.data(), std::min(block.size(), most - bytes.size())), ec);
      bytes.insert(bytes.end(), block.begin(), block.begin() + static_cast<std::ptrdiff_t>(n));
    }
    if (ec) socket_.close(ec);  // as drivers do at the end of the stream
    return bytes;
  }
  void send(const Bytes& bytes) { asio::write(socket_, asio::buffer(bytes)); }
  void reset() {
    socket_.set_option(asio::socket_base::linger(true, 0));
    socket_.close();
  }

 private:
  asio::io_context io_;
  tcp::socket socket_;
};

inline ReplayOptions as_fast_as_read() {
  ReplayOptions options;
  options.stepped = true;
  return options;
}

}  // namespace sonar
