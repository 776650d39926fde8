// The page of `sonard replay`: the recording's pictures, with a time line for each viewer. It does not change what the driver
// gets.
#pragma once

#include "daemon/server/connections/connection_listener.hpp"
#include "daemon/server/connections/http_connection.hpp"
#include "daemon/server/view/recording_views.hpp"

namespace sonar {

class ReplayPage final : public HttpService {
 public:
  /// The arguments must outlive the page.
  ReplayPage(asio::io_context& io, const LimitConfig& limits, Admission& admission, Log& log, PlayedRecording of);

  Result<void> open(Endpoint at) { return listener_.open(at); }
  void start() { listener_.start(); }
  void stop() { listener_.stop(); }
  Endpoint at() const { return listener_.at(); }

  asio::awaitable<HttpOutcome> answer(const HttpRequest& request, HttpConnection& from) override;
  HttpAnswer refusal(const HttpRefusal& refusal) const override;

 private:
  const LimitConfig& limits_;
  PlayedRecording of_;
  ConnectionServices services_;
  ControlConfig access_;  // the access rules of a sonard without a configuration
  ViewSecrets secrets_;
  RecordingViews views_;
  ConnectionListener<HttpConnection> listener_;
};

}  // namespace sonar
