// One request over HTTP, for the client side. Used by doctor and by waterlinked_stream.
#pragma once

#include <chrono>
#include <string>

#include "clients/sonarctl/net.hpp"

namespace sonar::clients {

struct HttpReply {
  unsigned status = 0;
  std::string body;
};
/// A body is sent as JSON. unavailable: no connection; bad_data: what answers within `patience` is not HTTP.
Result<HttpReply> http_ask(const Endpoint& at, const std::string& method, const std::string& path, const std::string& body,
                           std::chrono::milliseconds patience);

}  // namespace sonar::clients
