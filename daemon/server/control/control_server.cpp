#include "daemon/server/control/control_server.hpp"

#include <utility>

#include "daemon/server/recording/recording_file.hpp"
#include "daemon/server/system/listen.hpp"
#include "daemon/server/view/view_feed.hpp"
#include "protocol/control/answers.hpp"

namespace sonar {
namespace {

using control::StatusCode;

}  // namespace

/// Each branch is a kind of action that the router can choose; the last branch is help.
asio::awaitable<HttpOutcome> ControlHttp::answer(const HttpRequest& request, HttpConnection& from) {
  RoutedRequest routed = route_request(request, {services_.token, from.reached().ip, config_.hosts});
  if (!routed.pose_refusal.empty()) targets_.poses.refuse(routed.pose_refusal, from.sender());
  if (auto* answer = std::get_if<HttpAnswer>(&routed.action)) {
    if (view_ != nullptr && answer->type.starts_with("text/html")) view_->expect_viewer();
    co_return std::move(*answer);
  }
  if (const auto* wanted = std::get_if<control::Subscribe>(&routed.action)) co_return stream_of(*wanted);
  if (const auto* asked = std::get_if<HealthAction>(&routed.action)) co_return health(asked->with_text);
  if (const auto* asked = std::get_if<SocketAction>(&routed.action)) co_return open_socket(request, *asked, from);
  if (std::holds_alternative<TicketAction>(routed.action) && view_ != nullptr)
    co_return HttpAnswer{200, "{\"ticket\":\"" + view_->secrets().new_ticket(ViewSecrets::Steady::now()) + "\"}\n"};
  if (std::holds_alternative<MetricsAction>(routed.action))
    co_return HttpAnswer{200, targets_.operations.metrics(), "text/plain; version=0.0.4; charset=utf-8"};
  if (auto* asked = std::get_if<OperationAction>(&routed.action)) co_return co_await perform(std::move(asked->operation), from);
  HttpAnswer help{200, help_text(text_of(from.reached())), "text/plain; charset=utf-8"};
  help.headers = {{"Vary", "Accept"}};
  co_return help;
}

/// Checks in this order: a live view exists, this client may open it, the recording exists, a slot is free.
HttpOutcome ControlHttp::open_socket(const HttpRequest& request, const SocketAction& asked, HttpConnection& from) {
  if (view_ == nullptr) return answer_of(404, StatusCode::unsupported, "there is no live view");
  auto opened = open_view(request, asked.query, {services_.token, view_->secrets(), from.reached().ip, config_},
                          ViewSecrets::Steady::now());
  if (auto* answer = std::get_if<HttpAnswer>(&opened)) return *std::move(answer);
  if (const std::string& name = std::get<ViewWelcome>(opened).recording;
      !name.empty() && (view_->folder_of_recordings().empty() || !RecordingFile::is_plain_name(name)))
    return answer_of(404, StatusCode::unsupported, "no such recording: recording=NAME is a file in recording.folder");
  if (view_->is_full() || !from.claim_slot()) {
    HttpAnswer full =
        answer_of(503, StatusCode::failed, "all slots of viewers are in use; raise limits.viewers in the configuration");
    full.why = "all " + std::to_string(services_.limits.viewers) + " viewer slots are in use: limits.viewers";
    return full;
  }
  const ViewWelcome& welcome = std::get<ViewWelcome>(opened);
  if (!welcome.recording.empty())
    return view_->recordings().open(
        services_, from, request, welcome,
        {.file = view_->folder_of_recordings() / welcome.recording, .within = view_->folder_of_recordings()});
  return std::shared_ptr<HttpTakeover>(
      std::make_shared<ViewConnection>(services_, from, *view_, request, welcome,
                                       [view = view_](const std::shared_ptr<ViewConnection>& viewer) { view->add(viewer); }));
}

HttpAnswer ControlHttp::refusal(const HttpRefusal& refusal) const {
  return answer_of(refusal.status, refusal.status == 503 ? StatusCode::failed : StatusCode::refused, refusal.why);
}

HttpAnswer ControlHttp::health(bool with_text) const {
  const std::string problem = targets_.operations.problem();
  if (problem.empty()) return {200, "ok\n", "text/plain"};
  return {503, (with_text ? problem : "unhealthy") + "\n", "text/plain"};
}

/// Performs an operation. The result may arrive at once, after minutes, or after the time limit.
asio::awaitable<HttpAnswer> ControlHttp::perform(control::Operation operation, HttpConnection& from) {
  const auto result = std::make_shared<std::optional<OperationResult>>();
  const Operations::Done done = [weak = from.weak_from_this(), result](OperationResult made) {
    *result = std::move(made);
    // The operation may end after its connection.
    if (const auto connection = weak.lock()) connection->wait_timer().cancel();
  };
  const HasLeft has_left = [weak = from.weak_from_this()] {
    const auto connection = weak.lock();
    return !connection || connection->over() || sonar::has_left(connection->socket());
  };
  targets_.operations.perform(operation, from.sender(), done, has_left);
  asio::steady_timer& timer = from.wait_timer();
  timer.expires_after(operation_limit);
  while (!*result && !from.over() && timer.expiry() > HttpConnection::Steady::now()) {  // the result cancels the wait
    error_code ec;
    co_await timer.async_wait(into(ec));
  }
  if (*result) co_return answer_from(**result);
  co_return answer_of(
      504, StatusCode::failed,
      "not finished after 5 minutes; the operation continues (a step ends with this connection), see /api/v1/status");
}

HttpStream ControlHttp::stream_of(const control::Subscribe& wanted) {
  const auto queue = std::make_shared<EventQueue>();
  queue->subscribe(wanted);
  HttpStream stream;
  stream.type = "application/x-ndjson";
  stream.subscribe = [&events = targets_.events, queue](std::function<void()> wake) {
    return events.listen([queue, wake = std::move(wake)](const v1::Event& event) {
      if (queue->offer(event)) wake();
    });
  };
  stream.next = [queue]() -> std::optional<std::string> {
    const auto event = queue->next();
    return event ? std::optional(control::json_of(*event) + "\n") : std::nullopt;
  };
  return stream;
}

ControlServer::ControlServer(asio::io_context& io, const ControlConfig& config, const LimitConfig& limits, Admission& admission,
                             Operations& operations, Events& events, PoseIntake& poses, Log& log, ViewFeed* view)
    : config_(config),
      services_{io, limits, admission, log, "control"},
      targets_{operations, events, poses, SharedRate(limits.pose_bytes_per_s)},
      answers_(services_, config, targets_, view),
      stream_(services_, "protobuf",
              [this](tcp::socket socket, Sender sender) {
                return std::make_shared<StreamConnection>(services_, targets_, std::move(socket), std::move(sender));
              }),
      http_(services_, "http", [this](tcp::socket socket, const Sender& sender) {
        return std::make_shared<HttpConnection>(services_, answers_, std::move(socket), sender);
      }) {}

Result<void> ControlServer::read_token() {
  const ControlConfig& config = config_;
  if (config.token_file.empty()) return {};
  std::string warning;
  auto token = Token::read(config.token_file, warning);
  if (!token) return tl::make_unexpected(token.error());
  if (!warning.empty()) services_.log.warning(warning);
  services_.token = *std::move(token);
  return {};
}

template <class Connection>
Result<void> ControlServer::open(ConnectionListener<Connection>& listener, const PoseListener& wanted, bool given,
                                 const std::string& key) {
  if (!wanted.enabled) return {};
  const auto opened = listener.open(wanted.at);
  if (opened) return {};
  const std::string what = opened.error().text + "; " + key + " in the configuration can set another address, or off";
  if (given) return failure(opened.error().kind, what);
  services_.log.warning("continuing without " + key + ": " + what);
  return {};
}

Result<void> ControlServer::open() {
  if (auto r = read_token(); !r) return r;
  const ControlConfig& config = config_;
  if (auto r = open(stream_, config.stream, config.stream_given, "control.stream"); !r) return r;
  return open(http_, config.http, config.http_given, "control.http");
}

void ControlServer::start() {
  stream_.start();
  http_.start();
}

void ControlServer::stop() {
  stream_.stop();
  http_.stop();
}

}  // namespace sonar
