// The WebSocket of one viewer, which takes over an HTTP connection after an accepted handshake. It moves messages between the
// socket and a Viewer, which makes all decisions, and closes if the viewer reads no byte for limits.stall_s. Input has the same
// rate limit as HTTP. Only the I/O thread uses it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "daemon/emulator/view/viewer.hpp"
#include "daemon/server/connections/http_connection.hpp"
#include "daemon/server/connections/input_rate.hpp"
#include "daemon/server/http/door.hpp"

namespace sonar {

// Computes the work that the WebSocket frames of a viewer cause: each frame costs time in addition to its bytes. FrameWork parses
// the headers of frames itself, because the library reports neither empty fragments nor control frames (RFC 6455, 5.2). The
// bytes may arrive in any pieces.

class FrameWork {
 public:
  /// Returns the work of the next bytes of the stream: their number, and a fixed amount for each frame that begins in them.
  std::size_t of(std::span<const std::byte> received) {
    std::size_t work = received.size();
    for (std::size_t i = 0; i < received.size();) {
      if (payload_left_ > 0) {
        const auto skipped = std::min<std::uint64_t>(payload_left_, received.size() - i);
        payload_left_ -= skipped;
        i += static_cast<std::size_t>(skipped);
        continue;
      }
      work += take(std::to_integer<std::uint8_t>(received[i++]));
    }
    return work;
  }

 private:
  /// Parses one byte of a frame header. Returns the fixed work of the frame if the byte is the first of the header, else 0.
  std::size_t take(std::uint8_t byte) {
    std::size_t work = 0;
    if (at_ == 0) {
      work = (byte & 0x08) != 0 ? work::of_control_frame : work::of_frame;
    } else if (at_ == 1) {
      length_ = byte & 0x7F;
      length_bytes_ = length_ == 126 ? 2 : length_ == 127 ? 8 : 0;
      mask_bytes_ = (byte & 0x80) != 0 ? 4 : 0;
      if (length_bytes_ > 0) length_ = 0;
    } else if (at_ < 2 + length_bytes_) {
      length_ = length_ << 8 | byte;
    }
    if (++at_ < 2 || at_ < 2 + length_bytes_ + mask_bytes_) return work;
    payload_left_ = length_;
    at_ = 0;
    return work;
  }

  std::size_t at_ = 0, length_bytes_ = 0, mask_bytes_ = 0;  // position in the header; sizes of its parts
  std::uint64_t length_ = 0, payload_left_ = 0;
};

class ViewConnection final : public HttpTakeover, public std::enable_shared_from_this<ViewConnection> {
 public:
  using Steady = std::chrono::steady_clock;
  static Viewer::Moment now() { return Steady::now().time_since_epoch(); }

  /// `services`, `from` and `host` must outlive the connection. `on_open` is called after the handshake.
  ViewConnection(ConnectionServices& services, HttpConnection& from, ViewerHost& host, const HttpRequest& request,
                 const ViewWelcome& welcome, std::function<void(const std::shared_ptr<ViewConnection>&)> on_open);
  ~ViewConnection() override;

  asio::awaitable<bool> begin() override;
  asio::awaitable<void> read() override;
  asio::awaitable<void> write() override;
  void on_closing() override;

  Viewer& viewer() { return viewer_; }
  const Viewer& viewer() const { return viewer_; }
  bool over() const { return over_; }
  /// Returns the address with the port, which is unique among viewers.
  const std::string& address() const { return address_; }
  /// Returns the vehicle whose trajectory the viewer requested; empty = none.
  const std::string& playback() const { return playback_; }
  /// Call it when a message for the viewer waits.
  void wake() { wake_.cancel(); }

 private:
  asio::awaitable<bool> write(const ViewMessage& message);
  asio::awaitable<void> say_goodbye(std::uint16_t code, const char* why);
  void look_for_progress();

  struct Socket;
  struct Watched;
  ConnectionServices& services_;
  HttpConnection& from_;
  HttpRequest request_;
  std::string protocol_, address_, playback_;
  std::function<void(const std::shared_ptr<ViewConnection>&)> on_open_;
  Viewer viewer_;
  std::unique_ptr<Socket> socket_;
  asio::steady_timer wake_, stall_, rest_;
  Steady::time_point moved_at_{};  // time of the last byte sent to the viewer
  bool over_ = false, writing_ = false;
};

}  // namespace sonar
