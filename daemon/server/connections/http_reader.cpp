#include "daemon/server/connections/http_reader.hpp"

#include <algorithm>

#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>

namespace sonar {
namespace {

namespace http = boost::beast::http;
constexpr std::size_t shortest_last_chunk = 5;     // "0" and two line ends
constexpr std::size_t longest_unread = 64u << 10;  // Beast does not limit chunk headers and trailers

std::string text_of(boost::beast::string_view view) { return {view.data(), view.size()}; }

bool ends_with_bare_newline(std::string_view line_and_more) {
  const std::size_t end = line_and_more.find('\n');
  return end != std::string_view::npos && (end == 0 || line_and_more[end - 1] != '\r');
}

HttpRefusal refusal_of(const boost::beast::error_code& ec, std::size_t most_body) {
  if (ec == http::error::header_limit) return {431, "the header is longer than 8 KiB"};
  if (ec == http::error::body_limit) return {413, "the body is longer than " + std::to_string(most_body) + " bytes"};
  if (ec == http::error::bad_version) return {505, "only HTTP/1.0 and HTTP/1.1 are supported"};
  return {400, "this is not an HTTP request: " + ec.message()};
}

/// Returns the values of all headers with the name, joined (RFC 9110, 5.3).
std::string joined(const http::request<http::string_body>& message, http::field name) {
  std::string all;
  const auto [first, last] = message.equal_range(name);
  for (auto field = first; field != last; ++field) all += (all.empty() ? "" : ", ") + text_of(field->value());
  return all;
}

/// True for a Transfer-Encoding with which other parsers could find another end of the body; such a request is refused (RFC 9112,
/// 6.1).
bool has_other_coding(const http::request<http::string_body>& head) {
  return head.count(http::field::transfer_encoding) > 0 &&
         !boost::beast::iequals(joined(head, http::field::transfer_encoding), "chunked");
}

tl::expected<std::optional<HttpRequest>, HttpRefusal> request_from(http::request<http::string_body> message) {
  HttpRequest request;
  request.method = text_of(message.method_string());
  request.target = text_of(message.target());
  request.http_1_0 = message.version() == 10;
  if (message.count(http::field::host) > 1) return tl::unexpected(HttpRefusal{400, "more than one Host"});
  if (message.count(http::field::origin) > 1) return tl::unexpected(HttpRefusal{400, "more than one Origin"});
  request.has_host = message.count(http::field::host) == 1;
  request.has_origin = message.count(http::field::origin) > 0;
  request.host = text_of(message[http::field::host]);
  request.origin = text_of(message[http::field::origin]);
  request.authorization = text_of(message[http::field::authorization]);
  request.content_type = text_of(message[http::field::content_type]);
  request.upgrade = joined(message, http::field::upgrade);
  request.connection = joined(message, http::field::connection);
  request.accept = joined(message, http::field::accept);
  request.accept_encoding = joined(message, http::field::accept_encoding);
  request.if_none_match = joined(message, http::field::if_none_match);
  request.socket_key = joined(message, http::field::sec_websocket_key);
  request.socket_version = joined(message, http::field::sec_websocket_version);
  request.socket_protocols = joined(message, http::field::sec_websocket_protocol);
  request.keep_alive = message.keep_alive();
  request.body = std::move(message.body());
  return std::optional(std::move(request));
}

}  // namespace

struct HttpReader::Parser {
  http::request_parser<http::string_body> beast;
  explicit Parser(std::size_t most_body) {
    beast.eager(true);
    beast.header_limit(longest_header);
    beast.body_limit(most_body);
  }
};

HttpReader::HttpReader(std::size_t most_body)
    : most_body_(std::min(most_body, longest_body)), parser_(std::make_unique<Parser>(most_body_)) {}
HttpReader::~HttpReader() = default;

void HttpReader::feed(std::span<const std::byte> received) {
  for (const std::byte b : received) buffer_ += static_cast<char>(b);
}

bool HttpReader::begun() const { return !buffer_.empty() || parser_->beast.got_some(); }

/// Passes bytes to Beast until a request is complete or more bytes are needed. Each request has a new parser, because limits and
/// state are per request.
tl::expected<std::optional<HttpRequest>, HttpRefusal> HttpReader::next() {
  auto& beast = parser_->beast;
  while (!buffer_.empty() && !beast.is_done()) {
    // Beast 1.74 assumes five bytes when it parses a last chunk again. A complete last chunk has at least five bytes.
    if (beast.is_header_done() && beast.chunked() && buffer_.size() < shortest_last_chunk) break;
    boost::beast::error_code ec;
    const std::size_t used = beast.put(boost::asio::const_buffer(buffer_.data(), buffer_.size()), ec);
    buffer_.erase(0, used);
    if (beast.is_header_done() && has_other_coding(beast.get()))
      return tl::unexpected(HttpRefusal{501, "a Transfer-Encoding other than chunked"});
    if (ec == http::error::need_more) {
      if (buffer_.size() > longest_unread) return tl::unexpected(HttpRefusal{400, "a chunk header is too long"});
      break;
    }
    if (ec && !beast.is_header_done() && ends_with_bare_newline(buffer_))
      return tl::unexpected(HttpRefusal{400, "lines of a request end in CR LF, and this one ends in LF alone"});
    if (ec) return tl::unexpected(refusal_of(ec, most_body_));
    if (used == 0) break;
  }
  if (!beast.is_done()) return std::optional<HttpRequest>{};
  auto message = beast.release();
  parser_ = std::make_unique<Parser>(most_body_);
  continued_ = false;
  auto request = request_from(std::move(message));
  if (request) (*request)->bytes_behind = !buffer_.empty();
  return request;
}

bool HttpReader::asks_to_continue() {
  const auto& beast = parser_->beast;
  if (continued_ || !beast.is_header_done() || beast.is_done()) return false;
  const auto expects = beast.get()[http::field::expect];
  return boost::beast::iequals(expects, "100-continue") && !std::exchange(continued_, true);
}

}  // namespace sonar
