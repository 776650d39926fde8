// Answers requests for the page of the live view with its files, without I/O. The page contains no data, so it needs no token.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "daemon/server/connections/http_reader.hpp"

namespace sonar {

// The compressed files of the page, which the build embeds (clients/web/bundle.py); none if sonard was built without the page.

struct PageFile {
  std::string_view path, type, hash;     // such as "/"; such as "text/html; ..."; hash of the content
  std::span<const unsigned char> bytes;  // content, compressed with gzip
};
std::span<const PageFile> page_files();

struct PageRequest {
  std::string_view path;  // path without the query
  std::string_view accept, accept_encoding, if_none_match;
};

/// Answers GET and HEAD: 304 if the client has this version, 406 for clients without gzip. Returns nullopt if the page has no
/// such path, and for "/" if `accept` does not name text/html, because the answer is then the help text.
std::optional<HttpAnswer> page_answer(const PageRequest& request, std::span<const PageFile> files = page_files());

}  // namespace sonar
