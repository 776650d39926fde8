// The page of the live view: which file answers a request, with which headers. Pure. The page holds no data, so it needs no
// token.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "daemon/server/connections/http_answer.hpp"
#include "daemon/server/view/page_files.hpp"

namespace sonar {

struct PageRequest {
  std::string_view path;  // without its query
  std::string_view accept, accept_encoding, if_none_match;
};

/// Answers GET and HEAD. nullopt if the path is not of the page, or is "/" and `accept` does not name text/html: then the help
/// text answers. 304 for the version that the client has, 406 for clients without gzip.
std::optional<HttpAnswer> page_answer(const PageRequest& request, std::span<const PageFile> files = page_files());

}  // namespace sonar
