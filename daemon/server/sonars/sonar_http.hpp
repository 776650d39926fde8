// The HTTP server of an emulated sonar (Port::Kind::http): passes requests to the vendor, but refuses those of web pages,
// recognised by Host and Origin. Device owns it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "daemon/server/connections/http_connection.hpp"
#include "daemon/server/connections/listener.hpp"

namespace sonar {

class SonarHttp final : public HttpService {
 public:
  using Answer = std::function<protocol::ResourceReply(const protocol::ResourceRequest&)>;

  /// The host names that requests may use, besides the sonar's address.
  using Names = std::function<std::vector<std::string>()>;

  /// `limits`, `admission` and `log` must outlive the server. `sonar`: name of the sonar in the log.
  SonarHttp(asio::io_context& io, const LimitConfig& limits, Admission& admission, Log& log, const std::string& sonar,
            Names names, Answer answer);

  Result<void> open(Endpoint at) { return listener_.open(at); }
  void start() { listener_.start(); }
  void stop() { listener_.stop(); }
  Endpoint at() const { return listener_.at(); }
  bool is_open() const { return listener_.is_open(); }
  bool gone() const { return listener_.gone(); }

  asio::awaitable<HttpOutcome> answer(const HttpRequest& request, HttpConnection& from) override;
  HttpAnswer refusal(const HttpRefusal& refusal) const override;

 private:
  ConnectionServices services_;
  Names names_;
  Answer answer_;
  ConnectionListener<HttpConnection> listener_;
};

}  // namespace sonar
