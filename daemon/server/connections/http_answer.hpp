// An answer of an HTTP server, as plain data.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace sonar {

struct HttpAnswer {
  unsigned status = 200;
  std::string body;
  std::string type = "application/json";
  std::string allow = {};  // Allow header of status 405
  std::string why = {};    // the reason of a refusal, for the log; empty = no line
  std::vector<std::pair<std::string, std::string>> headers = {};
};

}  // namespace sonar
