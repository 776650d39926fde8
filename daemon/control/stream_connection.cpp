#include "daemon/control/stream_connection.hpp"

#include <algorithm>
#include <utility>

#include "daemon/control/http_rules.hpp"

namespace sonar {
namespace {

using control::Response;
using control::StatusCode;

constexpr std::size_t longest_before_hello = 4096;  // strangers get no megabyte
constexpr std::size_t work_of_a_turn = 4096;        // bytes; then others have theirs
constexpr std::size_t least_work = 64;              // bytes that cost as much as a message does beside its own
constexpr auto never = std::chrono::steady_clock::time_point::max();

StatusCode code_of(OperationResult::Code code) {
  return code == OperationResult::Code::done      ? StatusCode::ok
         : code == OperationResult::Code::refused ? StatusCode::refused
                                                  : StatusCode::failed;
}

/// Nobody waits for an answer to it.
bool is_unasked(std::uint64_t id, const auto& operation) {
  return id == 0 && std::holds_alternative<control::PoseSample>(operation);
}

Response response_of(std::uint64_t id, OperationResult result) {
  Response response{id, code_of(result.code), std::move(result.text), false};
  if (auto* status = std::get_if<control::DaemonStatus>(&result.body)) response.body = std::move(*status);
  if (const auto* stepped = std::get_if<control::Stepped>(&result.body)) response.body = *stepped;
  return response;
}

}  // namespace

StreamConnection::StreamConnection(ControlContext& context, tcp::socket socket, Sender sender)
    : context_(context),
      socket_(std::move(socket)),
      sender_(std::move(sender)),
      greeting_(std::make_shared<Deadline>(socket_)),
      stall_(std::make_shared<Deadline>(socket_)),
      wake_reader_(context.io, never),
      wake_writer_(context.io, never),
      rest_(context.io),
      parser_(context.limits.control_message_bytes),
      rate_(context.limits.input_bytes_per_s) {}

void StreamConnection::close() {
  error_code ec;
  socket_.close(ec);
  subscription_.reset();
  greeting_->none();
  wake_reader_.cancel();
  wake_writer_.cancel();
  rest_.cancel();
}

// ---- requests

asio::awaitable<void> StreamConnection::read() {
  std::vector<std::byte> buffer(work_of_a_turn);
  std::size_t received = 0;
  greeting_->within(greeting_limit);
  while (!over() && !ending_) {
    error_code ec;
    const std::size_t n = co_await socket_.async_read_some(asio::buffer(buffer), into(ec));
    if (ec || over()) break;
    heard_at = Steady::now();
    received += n;
    if (speaks_http(std::span(buffer).first(n))) {
      say_refused(context_, "HTTP on the control stream, which is protobuf: HTTP is asked at control.http", sender_.id);
      break;
    }
    parser_.feed(std::span(buffer).first(n));
    Work work{n};
    while (!ending_ && !over()) {
      const auto message = parser_.next();
      if (!message) {
        say_refused(context_, message.error().text, sender_.id);
        ending_ = true;
        break;
      }
      if (!*message) break;
      ending_ = !take(**message, work);
      while (!over() && answers_.size() + under_way_ >= most_open_requests) co_await wake_reader_.async_wait(into(ec));
    }
    if (!greeted_ && received > longest_before_hello) ending_ = true;
    if (!ending_ && !over()) co_await rest(work);
  }
  ending_ = true;
  wake_writer_.cancel();  // it writes what is left, and closes
}

/// What a client sends beyond the limits, or beyond its share of poses, waits in the kernel.
asio::awaitable<void> StreamConnection::rest(const Work& work) {
  const auto now = Steady::now();
  auto pause = rate_.pause_after(work.bytes, now);
  if (work.pose_bytes > 0) {
    if (!pose_rate_) pose_rate_ = context_.pose_rate.join(context_.limits.pose_bytes_per_s);
    pause = std::max(pause, context_.pose_rate.pause_after(*pose_rate_, work.pose_bytes, now));
  }
  if (pause.count() == 0) co_return;
  error_code ec;
  rest_.expires_after(pause);
  co_await rest_.async_wait(into(ec));
}

/// A browser may send it for any page; what it sends must not count, however it reads as protobuf.
bool StreamConnection::speaks_http(std::span<const std::byte> received) {
  for (const std::byte b : received) {
    if (first_bytes_.size() == longest_http_method) break;
    first_bytes_ += static_cast<char>(b);
  }
  return begins_http_request(first_bytes_);
}

/// False: the conversation is over.
bool StreamConnection::take(control::BytesView message, Work& work) {
  work.bytes += least_work;
  const auto request = control::decode_request(message);
  if (!request) {
    if (request.error().pose && greeted_)
      context_.poses.refuse(request.error().why, sender_);
    else
      say_refused(context_, request.error().why, sender_.id);
    answer({request.error().id, StatusCode::refused, request.error().why, false});
    return greeted_ && request.error().is_protobuf;
  }
  if (const auto* hello = std::get_if<control::Hello>(&request->op)) return greet(request->id, *hello);
  if (!greeted_) return refuse_and_end(request->id, "the first message must be a Hello");
  if (is_unasked(request->id, request->op)) work.pose_bytes += message.size() + least_work;
  return take_greeted(*request);
}

bool StreamConnection::greet(std::uint64_t id, const control::Hello& hello) {
  if (hello.protocol_version != control::protocol_version) {
    answer({id, StatusCode::refused, "protocol_version must be " + std::to_string(control::protocol_version), true});
    return false;
  }
  if (!context_.token.matches(hello.token))
    return refuse_and_end(id, hello.token.empty() ? "this daemon wants a token in the Hello, from its control.token_file"
                                                  : "the token in the Hello is not that of control.token_file");
  if (let_in_ && !let_in_()) {
    answer({id, StatusCode::failed, "all places are taken by clients that are busy; try again, or close one", false});
    return false;
  }
  let_in_ = nullptr;
  greeted_ = true;
  greeting_->none();
  context_.log.debug("control client", {{"from", sender_.id}, {"name", hello.name.substr(0, 64)}});
  answer({id, StatusCode::ok, "", true});
  return true;
}

bool StreamConnection::refuse_and_end(std::uint64_t id, const std::string& why) {
  say_refused(context_, why, sender_.id);
  answer({id, StatusCode::refused, why, false});
  return false;
}

bool StreamConnection::take_greeted(const control::Request& request) {
  std::visit(
      [&](const auto& op) {
        using Op = std::decay_t<decltype(op)>;
        if constexpr (std::is_same_v<Op, control::Subscribe>) {
          subscribe(op);
          answer({request.id, StatusCode::ok, "", false});
        } else if constexpr (std::is_constructible_v<control::Operation, Op>) {
          perform(request.id, op);
        } else {
          answer({request.id, StatusCode::unsupported, "this version knows no such request", false});
        }
      },
      request.op);
  return true;
}

/// The answer may come later than others, and later than this connection lives.
void StreamConnection::perform(std::uint64_t id, const control::Operation& operation) {
  const bool unasked = is_unasked(id, operation);
  if (!unasked) ++under_way_;
  context_.operations.perform(operation, sender_, [weak = weak_from_this(), id, unasked](OperationResult result) {
    const auto self = weak.lock();
    if (!self) return;
    if (!unasked) --self->under_way_;
    self->wake_reader_.cancel();
    const bool silent = unasked && result.code == OperationResult::Code::done;
    if (!silent) self->answer(response_of(id, std::move(result)));
  });
}

void StreamConnection::subscribe(const control::Subscribe& wanted) {
  events_.want(wanted);
  if (!events_.wants_any()) {
    subscription_.reset();
  } else if (!subscription_) {
    subscription_ = context_.events.listen([weak = weak_from_this()](const control::Event& event) {
      if (const auto self = weak.lock(); self && self->events_.offer(event)) self->wake_writer_.cancel();
    });
  }
}

// ---- answers and events

void StreamConnection::answer(const Response& response) {
  answers_.push_back(control::delimited(control::encode_response(response)));
  wake_writer_.cancel();
}

asio::awaitable<void> StreamConnection::write() {
  while (!over()) {
    if (!answers_.empty()) {
      control::Bytes bytes = std::move(answers_.front());
      answers_.pop_front();
      if (!co_await write_whole(std::move(bytes))) break;
      wake_reader_.cancel();
    } else if (auto event = events_.next()) {
      const Response response{0, StatusCode::ok, "", false, *std::move(event)};
      if (!co_await write_whole(control::delimited(control::encode_response(response)))) break;
    } else if (ending_ && under_way_ == 0) {
      error_code ec;
      socket_.shutdown(tcp::socket::shutdown_send, ec);
      break;
    } else {
      error_code ec;
      co_await wake_writer_.async_wait(into(ec));
    }
  }
  close();
}

asio::awaitable<bool> StreamConnection::write_whole(control::Bytes bytes) {
  const bool whole = co_await sonar::write_whole(context_, socket_, *stall_, sender_, asio::buffer(bytes));
  if (whole) heard_at = Steady::now();
  co_return whole;
}

}  // namespace sonar
