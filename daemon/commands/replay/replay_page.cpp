#include "daemon/commands/replay/replay_page.hpp"

#include <utility>

#include "daemon/server/http/http_router.hpp"
#include "protocol/control/control.hpp"

namespace sonar {

ReplayPage::ReplayPage(asio::io_context& io, const LimitConfig& limits, Admission& admission, Log& log, PlayedRecording of)
    : limits_(limits),
      of_(std::move(of)),
      services_{io, limits, admission, log, "page"},
      views_(io, log),
      listener_(services_, "http", [this](tcp::socket socket, const Sender& sender) {
        return std::make_shared<HttpConnection>(services_, *this, std::move(socket), sender);
      }) {}

asio::awaitable<HttpOutcome> ReplayPage::answer(const HttpRequest& request, HttpConnection& from) {
  RoutedRequest routed = route_request(request, {services_.token, from.reached().ip, access_.hosts});
  if (auto* const answer = std::get_if<HttpAnswer>(&routed.action)) co_return std::move(*answer);
  if (const auto* const asked = std::get_if<SocketAction>(&routed.action)) {
    auto opened =
        open_view(request, asked->query, {services_.token, secrets_, from.reached().ip, access_}, ViewSecrets::Steady::now());
    if (auto* const answer = std::get_if<HttpAnswer>(&opened)) co_return std::move(*answer);
    if (views_.count() >= limits_.viewers || !from.claim_slot())
      co_return answer_of(503, control::StatusCode::failed, "all slots of viewers are in use");
    co_return views_.open(services_, from, request, std::get<ViewWelcome>(opened), of_);
  }
  if (std::holds_alternative<HelpAction>(routed.action))
    co_return HttpAnswer{200, "sonard replay: open this address in a browser\n", "text/plain"};
  if (std::holds_alternative<HealthAction>(routed.action))
    co_return HttpAnswer{200, std::string(control::health_of_replay) + of_.file.filename().string() + "\n", "text/plain"};
  co_return answer_of(404, control::StatusCode::unsupported, "sonard replay serves only its page");
}

HttpAnswer ReplayPage::refusal(const HttpRefusal& refusal) const {
  return answer_of(refusal.status, refusal.status == 503 ? control::StatusCode::failed : control::StatusCode::refused,
                   refusal.why);
}

}  // namespace sonar
