// The HTTP side of control: routes requests to operations, metrics, health and events (docs/control.md).
#pragma once

#include "daemon/server/connections/http_connection.hpp"
#include "daemon/server/control/control_targets.hpp"
#include "daemon/server/control/http_router.hpp"

namespace sonar {

class ControlHttp final : public HttpService {
 public:
  /// All of it outlives the service.
  ControlHttp(ConnectionServices& services, const ControlConfig& config, ControlTargets& targets)
      : services_(services), config_(config), targets_(targets) {}

  asio::awaitable<std::variant<HttpAnswer, HttpStream>> answer(const HttpRequest& request, HttpConnection& from) override;
  HttpAnswer refusal(const HttpRefusal& refusal) const override;

 private:
  HttpAnswer health(bool with_text) const;
  asio::awaitable<HttpAnswer> perform(control::Operation operation, HttpConnection& from);
  HttpStream stream_of(const control::Subscribe& wanted);

  ConnectionServices& services_;
  const ControlConfig& config_;
  ControlTargets& targets_;
};

}  // namespace sonar
