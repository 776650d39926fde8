// Sends one request over HTTP, for doctor and ping_stream.
#pragma once

#include <chrono>
#include <string>

#include "clients/sonarctl/net.hpp"

namespace sonar::clients {

struct HttpReply {
  unsigned status = 0;
  std::string body;
};
/// A body is sent as JSON. Errors: unavailable if there is no connection; bad_data if the answer within `patience` is not HTTP.
Result<HttpReply> http_ask(const Endpoint& at, const std::string& method, const std::string& path, const std::string& body,
                           std::chrono::milliseconds patience);

}  // namespace sonar::clients
