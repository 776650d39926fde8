// Opens files named by configurations, scenes and users, but only regular files. Opening a FIFO can block forever. Reading a
// device may never end, or may start an action. Recordings (protocol/recorded/byte_source.cpp) follow the same rule. The last
// function checks whether files can be created in a folder.
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

/// True if no file, folder or link has this name, not even a link without a target. For all other names open_regular() gives the
/// reason why they cannot be read.
bool is_absent(const std::filesystem::path& file);

/// Opens a file for reading in binary mode. Error: missing_file if it does not exist or is not a regular file ("x.png: is a
/// FIFO, not a regular file").
Result<OpenFile> open_regular(const std::filesystem::path& file);
/// Reads at most `most_bytes` + 1 bytes of the file, so that the caller can detect a file that is too long. Errors: those of
/// open_regular(), io if reading fails, unavailable if there is too little memory.
Result<std::string> read_regular(const std::filesystem::path& file, std::size_t most_bytes);

/// Opens a file for writing, without waiting for the reader of a FIFO. Returns -1 on failure; errno then has the reason, and
/// why_not_written() explains it.
int open_to_write(const std::filesystem::path& file, int flags);
std::string why_not_written(const std::filesystem::path& file, int error);

// Limits which files a program can read while it loads files of unknown origin, because such files can refer to any file of
// this computer.

/// After this call, open_regular() opens only files whose real path is below `folder`. Call it once, before threads start.
void confine_reads(const std::filesystem::path& folder);
/// Returns the folder passed to confine_reads(), or an empty path if every file may be read.
const std::filesystem::path& readable_folder();

/// Returns why files cannot be created in the folder, such as "is not a folder", to follow the folder's name in an error.
/// Returns an empty text if files can be created. The check writes nothing.
std::string why_no_files_in(const std::filesystem::path& folder);

}  // namespace sonar
