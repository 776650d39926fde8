// The WebSocket of one viewer, which takes over an HTTP connection after an accepted handshake. It moves messages between the
// socket and a Viewer, which makes all decisions, and closes if the viewer reads no byte for limits.stall_s. Input has the same
// rate limit as HTTP. Only the I/O thread uses it.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "daemon/emulator/view/viewer.hpp"
#include "daemon/server/connections/http_connection.hpp"
#include "daemon/server/http/door.hpp"

namespace sonar {

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
