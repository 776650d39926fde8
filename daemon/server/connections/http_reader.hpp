// Parses HTTP requests from a byte stream, with limits on all sizes. It uses Beast's parser, without I/O; the stream may arrive
// in any pieces.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.hpp"

namespace sonar {

// An answer of an HTTP server, as plain data.

struct HttpAnswer {
  unsigned status = 200;
  std::string body;
  std::string type = "application/json";
  std::string allow = {};  // Allow header of status 405
  std::string why = {};    // the reason for a refusal, for the log; empty = no line
  std::vector<std::pair<std::string, std::string>> headers = {};
};

struct HttpRequest {
  std::string method, target, host, origin, authorization, content_type, body;
  // Values of headers as received; several headers with the same name are joined with ", ".
  std::string upgrade, connection, accept, accept_encoding, if_none_match;
  std::string socket_key, socket_version, socket_protocols;  // Sec-WebSocket-...
  bool bytes_behind = false;                                 // true: bytes after the request had already arrived
  bool http_1_0 = false, keep_alive = true;
  bool has_host = false, has_origin = false;
};
struct HttpRefusal {
  unsigned status = 400;
  std::string why;
};

class HttpReader {
 public:
  static constexpr std::size_t longest_header = 8192, longest_body = std::size_t{1} << 20;

  /// `most_body`: limit of a body [bytes], at most longest_body.
  explicit HttpReader(std::size_t most_body = longest_body);
  ~HttpReader();
  void feed(std::span<const std::byte> received);
  /// Returns the next whole request; nullopt if more bytes are needed. Do not call it after a refusal.
  tl::expected<std::optional<HttpRequest>, HttpRefusal> next();
  /// Returns true once per request, if the header asks for "100 Continue" before the body is sent.
  bool asks_to_continue();
  /// True if a part of a request has been received.
  bool begun() const;

 private:
  struct Parser;
  std::size_t most_body_;
  std::unique_ptr<Parser> parser_;
  std::string buffer_;
  bool continued_ = false;
};

}  // namespace sonar
