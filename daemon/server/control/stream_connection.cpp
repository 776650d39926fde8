#include "daemon/server/control/stream_connection.hpp"

#include <algorithm>
#include <utility>

#include "daemon/server/system/listen.hpp"
#include "protocol/control/answers.hpp"

namespace sonar {
namespace {

using control::response_of;
using control::StatusCode;

constexpr std::size_t longest_before_hello = 4096;  // bytes that a client may send before its Hello is accepted
constexpr std::size_t work_of_a_turn = 4096;        // bytes after which other connections have their turn
constexpr std::size_t least_work = 64;              // cost of a message in addition to its bytes
constexpr std::size_t skipping_is_cheaper = 16;     // factor by which skipping a pose costs less than accepting it
constexpr int receive_buffer = 256 << 10;           // bytes; a larger buffer would only hold older poses
constexpr std::chrono::milliseconds between_looks{10};

StatusCode code_of(OperationResult::Code code) {
  return code == OperationResult::Code::done      ? StatusCode::ok
         : code == OperationResult::Code::refused ? StatusCode::refused
                                                  : StatusCode::failed;
}

/// Returns whether a request is a pose without an id, which is answered only if it is refused.
bool is_unasked(std::uint64_t id, const auto& operation) {
  return id == 0 && std::holds_alternative<control::PoseSample>(operation);
}

v1::Response response_to(std::uint64_t id, const OperationResult& result) {
  v1::Response response = response_of(id, code_of(result.code), result.text);
  if (result.status) *response.mutable_daemon() = *result.status;
  if (result.faults) *response.mutable_faults() = *result.faults;
  if (result.stepped) *response.mutable_stepped() = *result.stepped;
  return response;
}

v1::Response greeting(std::uint64_t id, StatusCode code, const std::string& text) {
  v1::Response response = response_of(id, code, text);
  response.mutable_hello()->set_protocol_version(control::protocol_version);
  response.mutable_hello()->set_name("sonard");
  return response;
}

}  // namespace

StreamConnection::StreamConnection(ConnectionServices& services, ControlTargets& targets, tcp::socket socket, Sender sender)
    : services_(services),
      targets_(targets),
      socket_(std::move(socket)),
      sender_(std::move(sender)),
      greeting_(std::make_shared<Deadline>(socket_)),
      stall_(std::make_shared<Deadline>(socket_)),
      wake_reader_(services.io, never),
      wake_writer_(services.io, never),
      rest_(services.io),
      parser_(services.limits.control_message_bytes),
      rate_(services.limits.input_bytes_per_s) {
  error_code ec;
  socket_.set_option(asio::socket_base::receive_buffer_size(receive_buffer), ec);
}

/// Closes the connection; may be called more than once. The coroutines return when their waits are cancelled.
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

/// Reads requests, a bounded number of bytes at a time. A pose above the rate limit waits in `newest_pose_` until the rate allows
/// it, another request arrives, or a newer pose replaces it.
asio::awaitable<void> StreamConnection::read() {
  std::vector<std::byte> buffer(work_of_a_turn);
  std::size_t received = 0;
  greeting_->within(greeting_limit);
  while (!over() && !ending_) {
    error_code ec;
    if (newest_pose_ && socket_.available(ec) == 0) {
      co_await take_newest_pose();
      continue;
    }
    const std::size_t n = co_await socket_.async_read_some(asio::buffer(buffer), into(ec));
    if (ec || over()) break;
    received += n;
    // Any web page can make a browser send an HTTP request here. The request must have no effect, even if it parses as protobuf.
    if (http_.speaks_http(std::span(buffer).first(n))) {
      log_refusal(services_, "HTTP request on the control stream, which is protobuf; use control.http for HTTP", sender_.id);
      break;
    }
    parser_.feed(std::span(buffer).first(n));
    Work work{n};
    while (!ending_ && !over()) {
      const auto message = parser_.next();
      if (!message) {
        log_refusal(services_, message.error().text, sender_.id);
        ending_ = true;
        break;
      }
      if (!*message) break;
      active_at = Steady::now();
      if (greeted_ && control::is_unasked_pose(**message) && is_beyond_pose_rate()) {
        newest_pose_.emplace((*message)->begin(), (*message)->end());
        // A skipped pose costs a sixteenth of its bytes.
        work.bytes -= std::min(work.bytes, (*message)->size() - (*message)->size() / skipping_is_cheaper);
        continue;
      }
      if (const auto pose = std::exchange(newest_pose_, std::nullopt)) accept(*pose, work);
      ending_ = !accept(**message, work);
      // While a client does not read answers, its requests are not read, so the number of waiting answers is bounded.
      while (!over() && answers_.size() + in_progress_ >= most_open_requests) co_await wake_reader_.async_wait(into(ec));
    }
    if (!greeted_ && received > longest_before_hello) ending_ = true;
    if (!ending_ && !over()) co_await limit_rate(work);
  }
  ending_ = true;
  wake_writer_.cancel();  // write() sends the remaining answers, then closes the connection
}

/// Returns whether the client has used up its share of the rate of poses. Then all but the newest of its poses are skipped, so
/// that no pose takes effect late.
bool StreamConnection::is_beyond_pose_rate() {
  if (!pose_rate_) pose_rate_ = targets_.pose_rate.join(services_.limits.pose_bytes_per_s);
  return targets_.pose_rate.left(*pose_rate_, Steady::now()) == 0;
}

/// Accepts the waiting pose when the rate allows it, or at once if the client has disconnected.
asio::awaitable<void> StreamConnection::take_newest_pose() {
  if (is_beyond_pose_rate() && !has_left(socket_)) {
    error_code ec;
    rest_.expires_after(between_looks);
    co_await rest_.async_wait(into(ec));
    co_return;
  }
  Work work;
  accept(*std::exchange(newest_pose_, std::nullopt), work);
  co_await limit_rate(work);
}

/// Waits if the client has exceeded its rate of bytes, or if its address has exceeded the limit of work. Meanwhile input waits in
/// the kernel.
asio::awaitable<void> StreamConnection::limit_rate(const Work& work) {
  const auto now = Steady::now();
  auto pause = rate_.pause_after(work.bytes, now);
  if (work.pose_bytes > 0) {
    if (!pose_rate_) pose_rate_ = targets_.pose_rate.join(services_.limits.pose_bytes_per_s);
    targets_.pose_rate.pause_after(*pose_rate_, work.pose_bytes, now);
  }
  if (unsettled_ > 0) pause = std::max(pause, services_.pause_after(sender_, std::exchange(unsettled_, 0)));
  if (pause.count() == 0) co_return;
  error_code ec;
  rest_.expires_after(pause);
  co_await rest_.async_wait(into(ec));
}

/// Returns false if the connection must be closed.
bool StreamConnection::accept(control::BytesView message, Work& work) {
  work.bytes += least_work;
  const auto request = control::decode_request(message);
  if (!request) {
    if (request.error().pose && greeted_)
      targets_.poses.refuse(request.error().why, sender_);
    else
      log_refusal(services_, request.error().why, sender_.id);
    answer(response_of(request.error().id, StatusCode::refused, request.error().why));
    return greeted_ && request.error().is_protobuf;
  }
  if (const auto* hello = std::get_if<control::Hello>(&request->op)) return greet(request->id, *hello);
  if (!greeted_) return refuse_and_end(request->id, StatusCode::refused, "the first message must be a Hello");
  // Poses without an id have a separate rate limit; other requests count as work of the address.
  if (is_unasked(request->id, request->op))
    work.pose_bytes += message.size() + least_work;
  else
    unsettled_ += message.size() + work::of_message;
  return accept_greeted(*request);
}

/// Checks the Hello: version, token, and a free slot for authenticated clients. Then the time limit for the greeting ends.
bool StreamConnection::greet(std::uint64_t id, const control::Hello& hello) {
  if (hello.protocol_version != control::protocol_version) {
    answer(greeting(id, StatusCode::refused, "protocol_version must be " + std::to_string(control::protocol_version)));
    return false;
  }
  if (!services_.token.matches(hello.token))
    return refuse_and_end(id, StatusCode::unauthenticated,
                          hello.token.empty() ? "token required: send the token of control.token_file in the Hello"
                                              : "the token in the Hello is not that of control.token_file");
  if (claim_slot_ && !claim_slot_()) {
    answer(response_of(id, StatusCode::failed, "all connection slots are in use; try again, or close another client"));
    return false;
  }
  claim_slot_ = nullptr;
  greeted_ = proved = true;
  greeting_->none();
  services_.log.debug("control client", {{"from", sender_.id}, {"name", hello.name.substr(0, 64)}});
  answer(greeting(id, StatusCode::ok, ""));
  return true;
}

/// Answers with a refusal, which is still written before the connection is closed.
bool StreamConnection::refuse_and_end(std::uint64_t id, StatusCode code, const std::string& why) {
  log_refusal(services_, why, sender_.id);
  answer(response_of(id, code, why));
  return false;
}

/// Always returns true, because a valid request after the greeting does not end the connection.
bool StreamConnection::accept_greeted(const control::Request& request) {
  std::visit(
      [&](const auto& op) {
        using Op = std::decay_t<decltype(op)>;
        if constexpr (std::is_same_v<Op, control::Subscribe>) {
          subscribe(op);
          answer(response_of(request.id, StatusCode::ok));
        } else if constexpr (std::is_constructible_v<control::Operation, Op>) {
          perform(request.id, op);
        } else {
          answer(response_of(request.id, StatusCode::unsupported, "this version does not support the request"));
        }
      },
      request.op);
  return true;
}

/// Performs a request. The result may arrive after results of later requests, or after the end of this connection.
void StreamConnection::perform(std::uint64_t id, const control::Operation& operation) {
  const bool unasked = is_unasked(id, operation);
  if (!unasked) ++in_progress_;
  const auto done = [weak = weak_from_this(), id, unasked](OperationResult result) {
    const auto self = weak.lock();
    if (!self) return;
    if (!unasked) --self->in_progress_;
    self->wake_reader_.cancel();
    const bool silent = unasked && result.code == OperationResult::Code::done;
    if (!silent) self->answer(response_to(id, result));
  };
  const auto has_left = [weak = weak_from_this()] {
    const auto self = weak.lock();
    return !self || self->over() || sonar::has_left(self->socket_);
  };
  targets_.operations.perform(operation, sender_, done, has_left);
}

/// Replaces the subscription, which has a listener only while it selects a kind of event.
void StreamConnection::subscribe(const control::Subscribe& wanted) {
  events_.subscribe(wanted);
  if (!events_.subscribes_any()) {
    subscription_.reset();
  } else if (!subscription_) {
    subscription_ = targets_.events.listen([weak = weak_from_this()](const v1::Event& event) {
      if (const auto self = weak.lock(); self && self->events_.offer(event)) self->wake_writer_.cancel();
    });
  }
}

// ---- answers and events

void StreamConnection::answer(const v1::Response& response) {
  answers_.push_back(control::delimited(control::encode_response(response)));
  unsettled_ += answers_.back().size();
  wake_writer_.cancel();
}

/// Writes answers before events. At the end it waits for requests in progress, so that each request gets an answer.
asio::awaitable<void> StreamConnection::write() {
  while (!over()) {
    if (!answers_.empty()) {
      control::Bytes bytes = std::move(answers_.front());
      answers_.pop_front();
      if (!co_await write_whole(std::move(bytes))) break;
      wake_reader_.cancel();
    } else if (auto event = events_.next()) {
      v1::Response response = response_of(0, StatusCode::ok);
      *response.mutable_event() = std::move(*event);
      if (!co_await write_whole(control::delimited(control::encode_response(std::move(response))))) break;
    } else if (ending_ && in_progress_ == 0) {
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
  const bool whole = co_await sonar::write_whole(services_, socket_, *stall_, sender_, asio::buffer(bytes));
  if (whole) active_at = Steady::now();
  co_return whole;
}

}  // namespace sonar
