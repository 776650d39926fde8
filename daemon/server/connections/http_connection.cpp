#include "daemon/server/connections/http_connection.hpp"

#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/http/chunk_encode.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/serializer.hpp>
#include <boost/beast/http/string_body.hpp>

namespace sonar {
namespace {

namespace http = boost::beast::http;
constexpr std::chrono::seconds drain_limit{2};  // limit for discarding input after the last answer

const HttpRefusal too_many{503, "too many connections are open"};

/// Fills in the header fields that all answers share. The status line is HTTP/1.1 for HTTP/1.0 clients too (RFC 9112, 2.3).
template <class Body>
http::response<Body> response_of(unsigned status, const std::string& type) {
  http::response<Body> response;
  response.result(status);
  response.set(http::field::server, "sonard");
  if (!type.empty()) response.set(http::field::content_type, type);
  response.set(http::field::cache_control, "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  return response;
}

enum class Part { all, head };
template <class Body>
std::string bytes_of(const http::response<Body>& response, Part part) {
  http::serializer<false, Body, http::fields> serializer(response);
  serializer.split(part == Part::head);
  std::string bytes;
  while (!(part == Part::head ? serializer.is_header_done() : serializer.is_done())) {
    error_code ec;
    serializer.next(ec, [&](error_code&, const auto& buffers) {
      bytes += boost::beast::buffers_to_string(buffers);
      serializer.consume(boost::beast::buffer_bytes(buffers));
    });
    if (ec) break;  // cannot happen: the body is in memory
  }
  return bytes;
}

std::string bytes_of(HttpAnswer answer, std::string_view connection, Part part) {
  auto response = response_of<http::string_body>(answer.status, answer.type);
  if (answer.status != 204 && answer.status != 304) response.content_length(answer.body.size());  // RFC 9110, 8.6
  if (!connection.empty()) response.set(http::field::connection, {connection.data(), connection.size()});
  if (!answer.allow.empty()) response.set(http::field::allow, answer.allow);
  for (const auto& [name, value] : answer.headers) response.set(name, value);
  if (answer.status == 401) response.set(http::field::www_authenticate, "Bearer");
  response.body() = std::move(answer.body);
  return bytes_of(response, part);
}

std::string head_of_stream(const std::string& type, bool chunked) {
  auto response = response_of<http::empty_body>(200, type);
  if (chunked) response.set(http::field::transfer_encoding, "chunked");
  response.set(http::field::connection, "close");
  return bytes_of(response, Part::head);
}

std::string chunk_of(const std::string& line) {
  return boost::beast::buffers_to_string(http::make_chunk(boost::asio::const_buffer(line.data(), line.size())));
}

Sender without_port(const Sender& sender) { return {sender.source, sender.source}; }

}  // namespace

HttpConnection::HttpConnection(ConnectionServices& services, HttpService& service, tcp::socket socket, const Sender& sender)
    : services_(services),
      service_(service),
      socket_(std::move(socket)),
      sender_(without_port(sender)),
      request_limit_(std::make_shared<Deadline>(socket_)),
      stall_(std::make_shared<Deadline>(socket_)),
      wake_reader_(services.io, never),
      wake_writer_(services.io, never),
      wake_operation_(services.io, never),
      rest_(services.io),
      reader_(services.limits.control_message_bytes) {
  error_code ec;
  const auto at = socket_.local_endpoint(ec);
  if (!ec && at.address().is_v4()) reached_ = {at.address().to_v4().to_bytes(), at.port()};
  const auto peer = socket_.remote_endpoint(ec);
  if (!ec && peer.address().is_v4()) peer_ = peer.address().to_v4().to_bytes();
}

/// Ends all waits, so that both coroutines return.
void HttpConnection::close() {
  if (takeover_ && !over()) takeover_->on_closing();
  error_code ec;
  socket_.close(ec);
  request_limit_->none();
  wake_reader_.cancel();
  wake_writer_.cancel();
  wake_operation_.cancel();
  rest_.cancel();
}

void HttpConnection::reject() {
  refusal_ = too_many;
  discards_ = true;
}

// ---- requests

// There are two coroutines: read() fills the parser and passes on one request; write() answers it and calls next_request(). While
// a request is being answered (busy_), nothing is read: pipelined requests wait in the parser and in the kernel, and are answered
// in order (RFC 9112, 9.3.2). The time limits are greeting_limit to complete a request, and keep_alive_limit between requests;
// there is none while an answer is made.
asio::awaitable<void> HttpConnection::read() {
  std::vector<std::byte> buffer(16384);
  request_limit_->within(greeting_limit);
  charge(work::of_connection);
  while (!over()) {
    error_code ec;
    if (takeover_) {
      co_await takeover_->read();
      break;
    }
    if (busy_ && !discards_) {  // there is one request at a time; later bytes wait in the kernel
      co_await wake_reader_.async_wait(into(ec));
      continue;
    }
    const std::size_t n = co_await socket_.async_read_some(asio::buffer(buffer), into(ec));
    if (ec || over()) break;
    if (!discards_) {
      if (!reader_.begun()) request_limit_->within(greeting_limit);
      reader_.feed(std::span(buffer).first(n));
    }
    co_await settle(n);
    if (!discards_ && !over()) hand_over();
  }
  peer_closed_ = true;
  wake_writer_.cancel();
  if (all_sent_) close();
}

/// Counts work for the address of the client, and waits while that address is above its limit.
asio::awaitable<void> HttpConnection::settle(std::size_t work) {
  const auto pause = services_.pause_after(sender_, work);
  if (pause.count() == 0 || over()) co_return;
  error_code ec;
  rest_.expires_after(pause);
  co_await rest_.async_wait(into(ec));
}

/// Passes the next complete request to write().
void HttpConnection::hand_over() {
  auto next = reader_.next();
  if (!next) {
    refusal_ = next.error();
  } else if (*next) {
    request_ = **std::move(next);
    active_at = Steady::now();
    proved = true;
    charge(work::of_request);
  } else {
    continue_asked_ = reader_.asks_to_continue();
    if (continue_asked_) wake_writer_.cancel();
    return;
  }
  busy_ = true;
  request_limit_->none();
  wake_writer_.cancel();
}

/// Called when an answer is sent. A request that has already been received is answered at once; otherwise keep_alive_limit
/// begins.
void HttpConnection::next_request() {
  busy_ = false;
  request_limit_->within(reader_.begun() ? std::chrono::seconds(greeting_limit) : std::chrono::seconds(keep_alive_limit));
  hand_over();
  wake_reader_.cancel();
}

/// Discards input for a moment before closing, because closing while the client still sends would cause an RST, which may destroy
/// the last answer.
void HttpConnection::finish_sending() {
  all_sent_ = true;
  if (peer_closed_ || over()) return close();
  error_code ec;
  socket_.shutdown(tcp::socket::shutdown_send, ec);
  discards_ = true;
  request_limit_->within(drain_limit);
  wake_reader_.cancel();
}

// ---- answers

/// Answers requests. read() sets `request_` or `refusal_` and waits while `busy_`; write() answers and wakes read().
asio::awaitable<void> HttpConnection::write() {
  while (!over() && !all_sent_) {
    if (std::exchange(continue_asked_, false)) {
      if (!co_await write_whole(bytes_of(http::response<http::empty_body>(http::status::continue_, 11), Part::head))) break;
    } else if (refusal_) {
      if (refusal_->status != 503) log_refusal(services_, refusal_->why, sender_.id);  // the listener logs 503
      co_await write_answer(service_.refusal(*refusal_), {false, false, true});
      break;
    } else if (request_) {
      co_await answer(*std::exchange(request_, std::nullopt));
    } else if (peer_closed_) {
      break;
    } else {
      error_code ec;
      co_await wake_writer_.async_wait(into(ec));
    }
  }
  charge(std::exchange(unsettled_, 0));
  finish_sending();
}

/// Returns false if the request has the token but no slot for authenticated clients is free.
bool HttpConnection::has_slot(const HttpRequest& request) {
  return !services_.token.matches(bearer_token(request.authorization)) || claim_slot();
}

/// Sends an answer: a stream until the client disconnects, a takeover by another protocol, or a document.
asio::awaitable<void> HttpConnection::answer(HttpRequest request) {
  if (!has_slot(request)) {
    refusal_ = too_many;
    co_return;
  }
  const Head head{request.http_1_0, request.method == "HEAD", !request.keep_alive};
  auto made = co_await service_.answer(request, *this);
  if (auto* stream = std::get_if<HttpStream>(&made)) {
    co_await write_stream(std::move(*stream), head);
    all_sent_ = true;
    co_return;
  }
  if (auto* takeover = std::get_if<std::shared_ptr<HttpTakeover>>(&made)) {
    charge(work::of_upgrade);
    if (co_await (*takeover)->begin()) {
      takeover_ = *takeover;
      wake_reader_.cancel();
      co_await takeover_->write();
    }
    all_sent_ = true;
    co_return close();
  }
  auto& answer = std::get<HttpAnswer>(made);
  if (!answer.why.empty()) log_refusal(services_, answer.why, sender_.id);
  if (!co_await write_answer(std::move(answer), head) || head.last) {
    all_sent_ = true;
    co_return;
  }
  co_await settle(std::exchange(unsettled_, 0));
  if (!over()) next_request();
}

/// Writes chunks to HTTP/1.1 clients. HTTP/1.0 has no chunks (RFC 9112, 6.1), so the end of the connection ends the body.
asio::awaitable<void> HttpConnection::write_stream(HttpStream stream, Head head) {
  discards_ = true;  // reading continues, to detect that the client disconnects
  wake_reader_.cancel();
  if (!co_await write_whole(head_of_stream(stream.type, !head.http_1_0)) || head.without_body) co_return;
  const auto subscription = stream.subscribe([weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->wake_writer_.cancel();
  });
  while (!over() && !peer_closed_) {
    if (auto piece = stream.next()) {
      if (!head.http_1_0) *piece = chunk_of(*piece);
      if (!co_await write_whole(*std::move(piece))) co_return;
    } else {
      error_code ec;
      co_await wake_writer_.async_wait(into(ec));
    }
  }
}

asio::awaitable<bool> HttpConnection::write_answer(HttpAnswer answer, Head head) {
  const char* connection = head.last ? "close" : head.http_1_0 ? "keep-alive" : "";  // HTTP/1.1 keeps the connection by default
  std::string bytes = bytes_of(std::move(answer), connection, head.without_body ? Part::head : Part::all);
  unsettled_ += bytes.size();
  return write_whole(std::move(bytes));
}

asio::awaitable<bool> HttpConnection::write_whole(std::string bytes) {
  const bool whole = co_await sonar::write_whole(services_, socket_, *stall_, sender_, asio::buffer(bytes));
  if (whole) active_at = Steady::now();
  co_return whole;
}

}  // namespace sonar
