// The two ways to steer a running daemon: the control stream, which is protobuf over TCP, and HTTP with JSON (docs/control.md).
// Owned by App; what is asked is carried out by Operations.
#pragma once

#include <string>

#include "daemon/control/connection_door.hpp"
#include "daemon/control/http_connection.hpp"
#include "daemon/control/stream_connection.hpp"

namespace sonar {

class ControlServer {
 public:
  /// All of it outlives the server.
  ControlServer(asio::io_context& io, const ControlConfig& config, const LimitConfig& limits, Admission& admission,
                Operations& operations, Events& events, PoseIntake& poses, Log& log);

  /// Reads the token and opens both listeners. A default address that is taken is a warning; one from the file is an error.
  Result<void> open();
  void start();
  void stop();

  /// Where they listen, with the ports the system chose for 0. Port 0 = not at all.
  Endpoint stream() const { return stream_.at(); }
  Endpoint http() const { return http_.at(); }

 private:
  Result<void> read_token();
  template <class Connection>
  Result<void> open(ConnectionDoor<Connection>& door, const PoseListener& wanted, bool given, const std::string& key);

  ControlContext context_;
  ConnectionDoor<StreamConnection> stream_;
  ConnectionDoor<HttpConnection> http_;
};

}  // namespace sonar
