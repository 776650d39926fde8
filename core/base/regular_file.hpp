// Opens the files that configurations, scenes and users name, only if they are regular files. A FIFO could block for ever; a
// device could be read without end, or act when it is read. Every reader of such files opens them here.
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

/// For reading, bytes as they are. missing_file when there is none, or what it is instead: "x.png: is a FIFO, not a regular
/// file".
Result<OpenFile> open_regular(const std::filesystem::path& file);
/// All of it, or the first `most_bytes` + 1: the caller rejects what is too long. io when reading fails,
/// unavailable when memory does not suffice.
Result<std::string> read_regular(const std::filesystem::path& file, std::size_t most_bytes);

}  // namespace sonar
