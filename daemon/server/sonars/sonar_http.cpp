#include "daemon/server/sonars/sonar_http.hpp"

#include <algorithm>
#include <utility>

#include "daemon/server/http/http_router.hpp"

namespace sonar {

SonarHttp::SonarHttp(asio::io_context& io, const LimitConfig& limits, Admission& admission, Log& log, const std::string& sonar,
                     Names names, Answer answer)
    : services_{io, limits, admission, log, "sonar " + sonar, Admission::Purpose::client},
      names_(std::move(names)),
      answer_(std::move(answer)),
      listener_(services_, "http", [this](tcp::socket socket, const Sender& sender) {
        return std::make_shared<HttpConnection>(services_, *this, std::move(socket), sender);
      }) {}

/// Refuses requests of web pages of other sites, and passes other requests to the vendor.
asio::awaitable<HttpOutcome> SonarHttp::answer(const HttpRequest& request, HttpConnection& from) {
  // Programs send the sonar's address as Host, and no Origin (docs/control.md, "Access").
  const std::vector<std::string> names = names_();
  const bool host = request.has_host ? host_allowed(request.host, from.reached().ip, names) : request.http_1_0;
  if (!host || (request.has_origin && !origin_allowed(request.origin, from.reached().ip, names))) {
    HttpAnswer refused{403, "a web page of another site may not use this sonar\n", "text/plain"};
    refused.why = std::string("HTTP by ") +
                  (host ? "a page of Origin " + request.origin.substr(0, 200) : "the name " + request.host.substr(0, 200)) +
                  "; control.hosts in the configuration permits further names";
    co_return refused;
  }
  const std::size_t path_end = std::min(request.target.find('?'), request.target.size());
  protocol::ResourceRequest resource;
  resource.method = request.method == "HEAD" ? "GET" : request.method;
  resource.path = request.target.substr(0, path_end);
  resource.query = request.target.substr(std::min(path_end + 1, request.target.size()));
  resource.content_type = request.content_type;
  resource.body = request.body;
  resource.from = from.peer();
  protocol::ResourceReply reply = answer_(resource);
  co_return HttpAnswer{reply.status, std::move(reply.body), std::move(reply.content_type), std::move(reply.allow)};
}

HttpAnswer SonarHttp::refusal(const HttpRefusal& refusal) const { return {refusal.status, refusal.why + "\n", "text/plain"}; }

}  // namespace sonar
