#include "daemon/server/sonars/sonar_http.hpp"

#include <algorithm>
#include <utility>

namespace sonar {

SonarHttp::SonarHttp(asio::io_context& io, const LimitConfig& limits, Admission& admission, Log& log, const std::string& sonar,
                     Answer answer)
    : services_{io, limits, admission, log, "sonar " + sonar, Admission::Purpose::client},
      answer_(std::move(answer)),
      listener_(services_, "http", [this](tcp::socket socket, const Sender& sender) {
        return std::make_shared<HttpConnection>(services_, *this, std::move(socket), sender);
      }) {}

asio::awaitable<HttpOutcome> SonarHttp::answer(const HttpRequest& request, HttpConnection& from) {
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
