// Parses HTTP requests from a byte stream, with limits on all sizes. Beast's parser without I/O: any split of the stream gives
// the same requests.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/base/result.hpp"

namespace sonar {

struct HttpRequest {
  std::string method, target, host, origin, authorization, content_type, body;
  // Values of headers as they were received; several headers of a name are joined by ", ".
  std::string upgrade, connection, accept, accept_encoding, if_none_match;
  std::string socket_key, socket_version, socket_protocols;  // Sec-WebSocket-...
  bool bytes_behind = false;                                 // more had been received when it was whole
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

  /// `most_body`: bytes, at most longest_body.
  explicit HttpReader(std::size_t most_body = longest_body);
  ~HttpReader();
  void feed(std::span<const std::byte> received);
  /// The next whole request; nullopt = more bytes are needed; a refusal is final.
  tl::expected<std::optional<HttpRequest>, HttpRefusal> next();
  /// True once per request, when its header asks for "100 Continue" before the body is sent.
  bool asks_to_continue();
  /// A request has been received in part.
  bool begun() const;

 private:
  struct Parser;
  std::size_t most_body_;
  std::unique_ptr<Parser> parser_;
  std::string buffer_;
  bool continued_ = false;
};

}  // namespace sonar
