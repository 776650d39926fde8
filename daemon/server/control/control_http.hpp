// The HTTP side of control: routes requests to operations, metrics, health and events (docs/control.md).
#pragma once

#include "daemon/server/connections/http_connection.hpp"
#include "daemon/server/control/control_targets.hpp"
#include "daemon/server/http/http_router.hpp"
#include "daemon/server/http/operation_answer.hpp"

namespace sonar {

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

}  // namespace sonar
