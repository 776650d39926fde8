// The two control interfaces of a running daemon: the control stream (protobuf over TCP) and HTTP with JSON (docs/control.md).
// App owns them; Operations executes the requests.
#pragma once

#include <string>

#include "daemon/server/connections/http_connection.hpp"
#include "daemon/server/connections/listener.hpp"
#include "daemon/server/control/stream_connection.hpp"
#include "daemon/server/http/http_router.hpp"
#include "daemon/server/http/operation_answer.hpp"

namespace sonar {

// The HTTP service of control: routes requests to operations, metrics, health and events (docs/control.md).

class ViewFeed;

class ControlHttp final : public HttpService {
 public:
  /// The arguments must outlive the service. Without `view` there is no live view.
  ControlHttp(ConnectionServices& services, const ControlConfig& config, ControlTargets& targets, ViewFeed* view)
      : services_(services), config_(config), targets_(targets), view_(view) {}

  asio::awaitable<HttpOutcome> answer(const HttpRequest& request, HttpConnection& from) override;
  HttpAnswer refusal(const HttpRefusal& refusal) const override;

 private:
  HttpAnswer health(bool with_text) const;
  asio::awaitable<HttpAnswer> perform(control::Operation operation, HttpConnection& from);
  HttpStream stream_of(const control::Subscribe& wanted);
  HttpOutcome open_socket(const HttpRequest& request, const SocketAction& asked, HttpConnection& from);

  ConnectionServices& services_;
  const ControlConfig& config_;
  ControlTargets& targets_;
  ViewFeed* view_;
};

class ControlServer {
 public:
  /// The arguments must outlive the server.
  ControlServer(asio::io_context& io, const ControlConfig& config, const LimitConfig& limits, Admission& admission,
                Operations& operations, Events& events, PoseIntake& poses, Log& log, ViewFeed* view = nullptr);

  /// Reads the token and opens both listeners. An address in use is an error if it is from the configuration; a default address
  /// only causes a warning.
  Result<void> open();
  void start();
  void stop();

  /// Return the addresses of the listeners, with the ports that the system chose. Port 0 = not listening.
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
