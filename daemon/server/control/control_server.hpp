// The two control interfaces of a running daemon: the control stream (protobuf over TCP) and HTTP with JSON (docs/control.md).
// Owned by App; Operations executes the requests.
#pragma once

#include <string>

#include "daemon/server/connections/connection_listener.hpp"
#include "daemon/server/control/control_http.hpp"
#include "daemon/server/control/stream_connection.hpp"

namespace sonar {

class ControlServer {
 public:
  /// The arguments must outlive the server.
  ControlServer(asio::io_context& io, const ControlConfig& config, const LimitConfig& limits, Admission& admission,
                Operations& operations, Events& events, PoseIntake& poses, Log& log, ViewFeed* view = nullptr);

  /// Reads the token and opens both listeners. If an address is in use: a warning for a default address, an error for an
  /// address from the configuration.
  Result<void> open();
  void start();
  void stop();

  /// The addresses of the listeners, with the ports that the system chose for 0. Port 0 = not listening.
  Endpoint stream() const { return stream_.at(); }
  Endpoint http() const { return http_.at(); }

 private:
  Result<void> read_token();
  template <class Connection>
  Result<void> open(ConnectionListener<Connection>& listener, const PoseListener& wanted, bool given, const std::string& key);

  const ControlConfig& config_;
  ConnectionServices services_;
  ControlTargets targets_;
  ControlHttp answers_;
  ConnectionListener<StreamConnection> stream_;
  ConnectionListener<HttpConnection> http_;
};

}  // namespace sonar
