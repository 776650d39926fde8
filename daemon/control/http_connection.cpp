#include "daemon/control/http_connection.hpp"

#include <array>
#include <utility>

#include "daemon/sonars/input_rate.hpp"

namespace sonar {
namespace {

using control::StatusCode;
constexpr auto never = std::chrono::steady_clock::time_point::max();
constexpr std::chrono::seconds goodbye_limit{2};  // for what the client still sends when it has been told to go

const HttpRefusal too_many{503, "too many connections are open"};

std::string_view phrase_of(unsigned status) {
  constexpr std::array<std::pair<unsigned, std::string_view>, 14> phrases = {{{200, "OK"},
                                                                              {400, "Bad Request"},
                                                                              {401, "Unauthorized"},
                                                                              {403, "Forbidden"},
                                                                              {404, "Not Found"},
                                                                              {405, "Method Not Allowed"},
                                                                              {409, "Conflict"},
                                                                              {413, "Payload Too Large"},
                                                                              {415, "Unsupported Media Type"},
                                                                              {431, "Request Header Fields Too Large"},
                                                                              {500, "Internal Server Error"},
                                                                              {503, "Service Unavailable"},
                                                                              {504, "Gateway Timeout"},
                                                                              {505, "HTTP Version Not Supported"}}};
  for (const auto& [number, phrase] : phrases)
    if (number == status) return phrase;
  return "Status";
}

std::string head_of(unsigned status, const std::string& type, const std::string& more) {
  std::string head = "HTTP/1.1 " + std::to_string(status) + ' ';
  head.append(phrase_of(status)).append("\r\nServer: sonard\r\nContent-Type: ").append(type);
  return head + "\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n" + more + "\r\n";
}

std::string bytes_of(const HttpAnswer& answer, std::string_view connection, bool without_body) {
  std::string more = "Content-Length: " + std::to_string(answer.body.size()) + "\r\n";
  if (!connection.empty()) more.append("Connection: ").append(connection).append("\r\n");
  if (!answer.allow.empty()) more += "Allow: " + answer.allow + "\r\n";
  if (answer.status == 401) more += "WWW-Authenticate: Bearer\r\n";
  return head_of(answer.status, answer.type, more) + (without_body ? "" : answer.body);
}

std::string chunk_of(const std::string& line) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string size;
  for (std::size_t n = line.size(); n > 0; n /= 16) size.insert(size.begin(), digits[n % 16]);
  return size + "\r\n" + line + "\r\n";
}

HttpAnswer answer_from(const OperationResult& result) {
  if (result.code == OperationResult::Code::refused) return answer_of(400, StatusCode::refused, result.text);
  if (result.code == OperationResult::Code::failed) return answer_of(409, StatusCode::failed, result.text);
  if (const auto* status = std::get_if<control::DaemonStatus>(&result.body)) return {200, control::json_of(*status) + "\n"};
  if (const auto* stepped = std::get_if<control::Stepped>(&result.body)) return {200, control::json_of(*stepped) + "\n"};
  return answer_of(200, StatusCode::ok, result.text);
}

Sender without_port(const Sender& sender) { return {sender.source, sender.source}; }

}  // namespace

HttpConnection::HttpConnection(ControlContext& context, tcp::socket socket, Sender sender)
    : context_(context),
      socket_(std::move(socket)),
      sender_(without_port(sender)),
      request_limit_(std::make_shared<Deadline>(socket_)),
      stall_(std::make_shared<Deadline>(socket_)),
      wake_reader_(context.io, never),
      wake_writer_(context.io, never),
      wake_operation_(context.io, never),
      rest_(context.io),
      reader_(context.limits.control_message_bytes) {
  error_code ec;
  const auto at = socket_.local_endpoint(ec);
  if (!ec && at.address().is_v4()) reached_ = {at.address().to_v4().to_bytes(), at.port()};
}

void HttpConnection::close() {
  error_code ec;
  socket_.close(ec);
  request_limit_->none();
  wake_reader_.cancel();
  wake_writer_.cancel();
  wake_operation_.cancel();
  rest_.cancel();
}

void HttpConnection::turn_away() {
  refusal_ = too_many;
  discards_ = true;
}

// ---- requests

asio::awaitable<void> HttpConnection::read() {
  std::vector<std::byte> buffer(16384);
  InputRate rate(context_.limits.input_bytes_per_s);
  request_limit_->within(greeting_limit);
  while (!over()) {
    error_code ec;
    if (busy_ && !discards_) {  // one request after the other; what comes meanwhile waits in the kernel
      co_await wake_reader_.async_wait(into(ec));
      continue;
    }
    const std::size_t n = co_await socket_.async_read_some(asio::buffer(buffer), into(ec));
    if (ec || over()) break;
    heard_at = Steady::now();
    if (!discards_) {
      if (!reader_.begun()) request_limit_->within(greeting_limit);
      reader_.feed(std::span(buffer).first(n));
      hand_over();
    }
    if (const auto pause = rate.pause_after(n, Steady::now()); pause.count() > 0 && !over()) {
      rest_.expires_after(pause);
      co_await rest_.async_wait(into(ec));
    }
  }
  ended_ = true;
  wake_writer_.cancel();
  if (said_all_) close();
}

/// What the reader has, if it is whole, to write().
void HttpConnection::hand_over() {
  auto next = reader_.next();
  if (!next) {
    refusal_ = next.error();
  } else if (*next) {
    request_ = **std::move(next);
  } else {
    continue_asked_ = reader_.asks_to_continue();
    if (continue_asked_) wake_writer_.cancel();
    return;
  }
  busy_ = true;
  request_limit_->none();
  wake_writer_.cancel();
}

void HttpConnection::next_request() {
  busy_ = false;
  request_limit_->within(reader_.begun() ? std::chrono::seconds(greeting_limit) : std::chrono::seconds(keep_alive_limit));
  hand_over();
  wake_reader_.cancel();
}

/// A client that is still sending when we close would lose our last answer: it is heard out for a moment.
void HttpConnection::goodbye() {
  said_all_ = true;
  if (ended_ || over()) return close();
  error_code ec;
  socket_.shutdown(tcp::socket::shutdown_send, ec);
  discards_ = true;
  request_limit_->within(goodbye_limit);
  wake_reader_.cancel();
}

// ---- answers

asio::awaitable<void> HttpConnection::write() {
  while (!over() && !said_all_) {
    if (std::exchange(continue_asked_, false)) {
      if (!co_await write_whole("HTTP/1.1 100 Continue\r\n\r\n")) break;
    } else if (refusal_) {
      const StatusCode code = refusal_->status == 503 ? StatusCode::failed : StatusCode::refused;
      const HttpAnswer refusal = answer_of(refusal_->status, code, refusal_->why);
      if (refusal_->status != 503) say_refused(context_, refusal_->why, sender_.id);  // the door has said that
      co_await write_answer(refusal, {false, false, true});
      break;
    } else if (request_) {
      co_await answer(*std::exchange(request_, std::nullopt));
    } else if (ended_) {
      break;
    } else {
      error_code ec;
      co_await wake_writer_.async_wait(into(ec));
    }
  }
  goodbye();
}

/// False: it shows the token, and there is no place for it.
bool HttpConnection::has_place(const HttpRequest& request) {
  if (!let_in_ || !context_.token.matches(bearer_token(request.authorization))) return true;
  return std::exchange(let_in_, nullptr)();
}

asio::awaitable<void> HttpConnection::answer(HttpRequest request) {
  if (!has_place(request)) {
    refusal_ = too_many;
    co_return;
  }
  Judgement judgement = judge(request, {context_.token, reached_.ip, context_.config.hosts});
  if (!judgement.pose_refusal.empty()) context_.poses.refuse(judgement.pose_refusal, sender_);
  const Head head{request.http_1_0, request.method == "HEAD", !request.keep_alive};
  if (const auto* wanted = std::get_if<control::Subscribe>(&judgement.wanted)) {
    co_await stream_events(*wanted, head);
    said_all_ = true;
    co_return;
  }
  HttpAnswer answer = co_await make_answer(std::move(judgement.wanted));
  if (!answer.why.empty()) say_refused(context_, answer.why, sender_.id);
  if (!co_await write_answer(std::move(answer), head) || head.last)
    said_all_ = true;
  else
    next_request();
}

HttpAnswer HttpConnection::health(bool with_text) const {
  const std::string trouble = context_.operations.trouble();
  if (trouble.empty()) return {200, "ok\n", "text/plain"};
  return {503, (with_text ? trouble : "in trouble") + "\n", "text/plain"};
}

asio::awaitable<HttpAnswer> HttpConnection::make_answer(Wanted wanted) {
  if (auto* answer = std::get_if<HttpAnswer>(&wanted)) co_return std::move(*answer);
  if (const auto* asked = std::get_if<WantsHealth>(&wanted)) co_return health(asked->with_text);
  if (std::holds_alternative<WantsMetrics>(wanted))
    co_return HttpAnswer{200, context_.operations.metrics(), "text/plain; version=0.0.4; charset=utf-8"};
  if (auto* asked = std::get_if<WantsOperation>(&wanted)) co_return co_await carry_out(std::move(asked->operation));
  co_return HttpAnswer{200, help_text(sonar::text_of(reached_)), "text/plain; charset=utf-8"};
}

/// The answer may come at once, or after minutes, or after we stopped waiting.
asio::awaitable<HttpAnswer> HttpConnection::carry_out(control::Operation operation) {
  const auto result = std::make_shared<std::optional<OperationResult>>();
  context_.operations.perform(operation, sender_, [weak = weak_from_this(), result](OperationResult done) {
    *result = std::move(done);
    if (const auto self = weak.lock()) self->wake_operation_.cancel();
  });
  wake_operation_.expires_after(operation_limit);
  while (!*result && !over() && wake_operation_.expiry() > Steady::now()) {  // one given up on may be done meanwhile
    error_code ec;
    co_await wake_operation_.async_wait(into(ec));
  }
  if (*result) co_return answer_from(**result);
  co_return answer_of(504, StatusCode::failed, "not done after 5 minutes; it goes on, see /api/v1/status");
}

asio::awaitable<void> HttpConnection::stream_events(control::Subscribe wanted, Head head) {
  const std::string more = head.http_1_0 ? "Connection: close\r\n" : "Transfer-Encoding: chunked\r\nConnection: close\r\n";
  discards_ = true;  // reading goes on: the end of it is how the client leaves
  wake_reader_.cancel();
  if (!co_await write_whole(head_of(200, "application/x-ndjson", more)) || head.without_body) co_return;
  events_.want(wanted);
  const auto subscription = context_.events.listen([weak = weak_from_this()](const control::Event& event) {
    if (const auto self = weak.lock(); self && self->events_.offer(event)) self->wake_writer_.cancel();
  });
  while (!over() && !ended_) {
    if (const auto event = events_.next()) {
      std::string line = control::json_of(*event) + "\n";  // GCC 12 destroys a ?: inside of co_await twice
      if (!head.http_1_0) line = chunk_of(line);
      if (!co_await write_whole(std::move(line))) co_return;
    } else {
      error_code ec;
      co_await wake_writer_.async_wait(into(ec));
    }
  }
}

asio::awaitable<bool> HttpConnection::write_answer(HttpAnswer answer, Head head) {
  const char* connection = head.last ? "close" : head.http_1_0 ? "keep-alive" : "";  // 1.1 keeps it unless told
  return write_whole(bytes_of(answer, connection, head.without_body));
}

asio::awaitable<bool> HttpConnection::write_whole(std::string bytes) {
  const bool whole = co_await sonar::write_whole(context_, socket_, *stall_, sender_, asio::buffer(bytes));
  if (whole) heard_at = Steady::now();
  co_return whole;
}

}  // namespace sonar
