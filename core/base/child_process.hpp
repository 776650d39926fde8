// Runs one of our programs for work that may crash the process. Its standard streams are files in memory, and it inherits no
// other files of this process.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.hpp"

namespace sonar {

/// A file without a name, which is gone when the last process closes it.
class MemoryFile {
 public:
  static Result<MemoryFile> make(const char* name);
  MemoryFile(MemoryFile&& other) noexcept;
  MemoryFile& operator=(MemoryFile&&) = delete;
  ~MemoryFile();

  int descriptor() const { return descriptor_; }

 private:
  explicit MemoryFile(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

struct ChildEnd {
  int signal = 0;     // signal that ended the program; 0 = it exited
  int exit_code = 0;  // -1: unknown, because this process ignores its children
};

/// Runs the program and waits for its end. It gets `arguments` after its name, this process's environment and folder, and the
/// three files as its standard streams; no other descriptor, no blocked or ignored signal, and a process group of its own.
Result<ChildEnd> run_child(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                           const MemoryFile& input, const MemoryFile& output, const MemoryFile& errors);

}  // namespace sonar
