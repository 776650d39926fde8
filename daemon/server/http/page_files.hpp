// The compressed files of the page, which the build embeds (clients/web/bundle.py); none if sonard was built without the page.
#pragma once

#include <span>
#include <string_view>

namespace sonar {

struct PageFile {
  std::string_view path, type, hash;     // "/"; "text/html; ..."; hash of the content
  std::span<const unsigned char> bytes;  // gzip
};
std::span<const PageFile> page_files();

}  // namespace sonar
