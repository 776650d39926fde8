// Opens the files that configurations, scenes and users name, only if they are regular files. A FIFO could block for ever;
// reading a device could never end or could trigger it. Every reader of such files opens them here.
#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "core/base/result.hpp"

namespace sonar {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using OpenFile = std::unique_ptr<std::FILE, CloseFile>;

/// Opens a file for reading, as binary. Error: missing_file if it does not exist or is not a regular file ("x.png: is a FIFO, not
/// a regular file").
Result<OpenFile> open_regular(const std::filesystem::path& file);
/// Reads the file, but at most `most_bytes` + 1 bytes, so that the caller can reject a file that is too long. Errors: io when
/// reading fails, unavailable when memory does not suffice.
Result<std::string> read_regular(const std::filesystem::path& file, std::size_t most_bytes);

}  // namespace sonar
