// The files of the page, compressed, as the build embeds them (clients/web/bundle.py). There are none if it was built without the
// page.
#pragma once

#include <span>
#include <string_view>

namespace sonar {

struct PageFile {
  std::string_view path, type, hash;     // "/", "text/html; ...", of the content
  std::span<const unsigned char> bytes;  // gzip
};
std::span<const PageFile> page_files();

}  // namespace sonar
