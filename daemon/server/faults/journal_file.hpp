// The file of the journal of faults. Lines are appended completely or not at all. Opening and writing never wait for the reader
// of a FIFO.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace sonar {

class JournalFile {
 public:
  /// Opens or creates the file. A FIFO must have a reader. Errors: io.
  static Result<std::shared_ptr<JournalFile>> open(const std::filesystem::path& file);
  /// Returns the error that open() would return, without creating the file.
  static Result<void> check(const std::filesystem::path& file);
  ~JournalFile();
  JournalFile(const JournalFile&) = delete;
  JournalFile& operator=(const JournalFile&) = delete;

  struct Written {
    std::uint64_t lines = 0;
    std::string why;  // why entries are missing; empty = none is missing
  };
  /// Appends lines. Stops at the first line that fails; a later call tries again.
  Written append(std::string_view lines);

 private:
  explicit JournalFile(int descriptor) : descriptor_(descriptor) {}
  std::string write_line(std::string_view line);

  int descriptor_;
  bool cut_ = false;  // true: the file ends with an incomplete line
};

}  // namespace sonar
