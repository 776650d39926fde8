// Recordings in memory, their replay in a thread of its own, and drivers at its sockets.
#pragma once

#include <gtest/gtest.h>
#include <poll.h>

#include <atomic>
#include <future>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/commands/replay/requested_replay.hpp"
#include "protocol/ping/messages.hpp"
#include "protocol/ping/ping_log.hpp"
#include "protocol/recorded/message_splitter.hpp"
#include "protocol/recording/recording.hpp"

namespace sonar::requested_replay_test {

using recording::Bytes;
using recording::Carrier;
using recording::Origin;
using recording::RecordedMessage;
using std::chrono::milliseconds;
constexpr milliseconds patience{20000};

class Messages final : public recording::RecordingReader {
 public:
  explicit Messages(std::vector<RecordedMessage> all) : all_(std::move(all)) {}
  std::optional<RecordedMessage> next() override { return at_ < all_.size() ? std::optional(all_[at_++]) : std::nullopt; }
  std::optional<Error> damage() const override { return {}; }
  void rewind() override { at_ = 0; }

 private:
  std::vector<RecordedMessage> all_;
  std::size_t at_ = 0;
};

using MakeWriter = std::unique_ptr<recording::RecordingWriter> (*)(std::unique_ptr<recording::Sink>);
inline constexpr MakeWriter raw_dump = [](std::unique_ptr<recording::Sink> sink) {
  return recording::write_raw_dump(std::move(sink));
};
inline constexpr MakeWriter ping_log = [](std::unique_ptr<recording::Sink> sink) {
  return recording::write_ping_log(std::move(sink));
};
inline Bytes file_of(MakeWriter make, const std::vector<Bytes>& messages) {
  Bytes file;
  const auto writer = make(recording::sink_into(file));
  for (const Bytes& message : messages) EXPECT_TRUE(writer->write({{}, Origin::device, Carrier::stream, message}));
  EXPECT_TRUE(writer->close());
  return file;
}

/// A recording on a disk that blocks until `goes_on` has a value or an exception.
class SlowDisk final : public recording::RecordingReader {
 public:
  SlowDisk(std::unique_ptr<recording::RecordingReader> of, std::shared_future<void> goes_on)
      : of_(std::move(of)), goes_on_(std::move(goes_on)) {}
  std::optional<RecordedMessage> next() override {
    if (stands_still) goes_on_.get();
    return of_->next();
  }
  std::optional<Error> damage() const override { return of_->damage(); }
  void rewind() override { of_->rewind(); }
  bool knows_times() const override { return of_->knows_times(); }
  std::string profile() const override { return of_->profile(); }
  std::atomic<bool> stands_still = false;

 private:
  std::unique_ptr<recording::RecordingReader> of_;
  std::shared_future<void> goes_on_;
};

/// A replay in a thread of its own. If `goes_on` is given, the disk blocks after open() until that has a value.
class Replay {
 public:
  explicit Replay(Bytes file, double rate_hz = 1000, std::shared_future<void> goes_on = {})
      : Replay(std::move(file), false, rate_hz, std::move(goes_on)) {}
  Replay(Bytes file, bool loop, double rate_hz = 1000, std::shared_future<void> goes_on = {})
      : log_([] {
          LogOptions quiet;
          quiet.sink = [](LogLevel, const std::string&) {};
          return quiet;
        }()) {
    auto opened = recording::open_recording(recording::source_from("recording", std::move(file)));
    if (!opened) throw std::runtime_error(opened.error().text);
    recording_ = std::move(*opened);
    SlowDisk* disk = nullptr;
    if (goes_on.valid()) {
      auto slow = std::make_unique<SlowDisk>(std::move(recording_.reader), std::move(goes_on));
      disk = slow.get();
      recording_.reader = std::move(slow);
    }
    auto device = find_replay_device(*recording_.reader, "recording", 1042);
    if (!device || !device->by_requests()) throw std::runtime_error("not by requests");
    ReplayOptions options;
    options.at = {{127, 0, 0, 2}, 0};
    options.rate_hz = rate_hz;
    options.loop = loop;
    server_ = std::make_unique<RequestedReplay>(io_, *recording_.reader, *device, options, log_);
    if (const auto listening = server_->open("recording"); !listening) throw std::runtime_error(listening.error().text);
    if (disk != nullptr) disk->stands_still = true;
    server_->start();
    done_ = std::async(std::launch::async, [this] { io_.run(); });
  }
  ~Replay() {
    asio::post(io_, [this] { server_->stop(); });
    done_.wait();
  }
  bool ends() { return done_.wait_for(patience) == std::future_status::ready; }
  /// Call figures() and outcome() only after the end of the replay.
  ReplayServer::Figures figures() const { return server_->figures(); }
  const Result<void>& outcome() const { return server_->outcome(); }

 private:
  Log log_;
  asio::io_context io_;
  recording::Recording recording_;
  std::unique_ptr<RequestedReplay> server_;
  std::future<void> done_;
};

class Tcp {
 public:
  explicit Tcp(std::uint16_t port) : socket_(io_) { socket_.connect({asio::ip::address_v4({127, 0, 0, 2}), port}); }
  void send(const Bytes& bytes) { asio::write(socket_, asio::buffer(bytes)); }
  void send(std::string_view text) { asio::write(socket_, asio::buffer(text)); }
  /// Returns the next bytes; none at the end of the stream.
  Bytes read() {
    Bytes bytes(1 << 16);
    pollfd waited{socket_.native_handle(), POLLIN, 0};
    if (::poll(&waited, 1, static_cast<int>(patience.count())) <= 0) {
      ADD_FAILURE() << "no byte for " << patience.count() << " ms";
      return {};
    }
    error_code ec;
    bytes.resize(socket_.read_some(asio::buffer(bytes), ec));
    if (ec) socket_.close(ec);
    return bytes;
  }
  Bytes read_to_end() {
    Bytes all;
    for (Bytes piece = read(); !piece.empty(); piece = read()) all.insert(all.end(), piece.begin(), piece.end());
    return all;
  }

 private:
  asio::io_context io_;
  tcp::socket socket_;
};

/// A host that uses UDP.
class Udp {
 public:
  explicit Udp(std::uint16_t port)
      : at_(asio::ip::address_v4({127, 0, 0, 2}), port), socket_(io_, udp::endpoint(asio::ip::address_v4::loopback(), 0)) {}
  void send(const Bytes& bytes) { socket_.send_to(asio::buffer(bytes), at_); }
  std::optional<ping::Frame> read() {
    pollfd waited{socket_.native_handle(), POLLIN, 0};
    if (::poll(&waited, 1, static_cast<int>(patience.count())) <= 0) return std::nullopt;
    Bytes datagram(1 << 16);
    datagram.resize(socket_.receive(asio::buffer(datagram)));
    return ping::whole_frame(datagram);
  }
  /// Returns the id of the next frame; Id{} if none came.
  ping::Id next_id() {
    const auto frame = read();
    return frame ? frame->header.id : ping::Id{};
  }

 private:
  asio::io_context io_;
  udp::endpoint at_;
  udp::socket socket_;
};

}  // namespace sonar::requested_replay_test
