// Runs one of our programs as a child process, for work that may crash. The standard streams of the child are files in memory.
// The child inherits no other open files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.hpp"

namespace sonar {

/// A file in memory, without a path. It is deleted when the last process closes it.
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
  int exit_code = 0;  // exit code of the program; -1: unknown, because this process ignores SIGCHLD
};

/// Runs the program and waits until it ends. The program gets `arguments`, the environment and working folder of this process,
/// and the three files as its standard streams. It inherits no other descriptors and no blocked or ignored signals. It runs in
/// its own process group.
Result<ChildEnd> run_child(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                           const MemoryFile& input, const MemoryFile& output, const MemoryFile& errors);

}  // namespace sonar
