#include "core/base/child_process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace sonar {
namespace {

struct Actions {
  posix_spawn_file_actions_t actions{};
  posix_spawnattr_t attributes{};
  Actions() { posix_spawn_file_actions_init(&actions), posix_spawnattr_init(&attributes); }
  ~Actions() { posix_spawn_file_actions_destroy(&actions), posix_spawnattr_destroy(&attributes); }
  Actions(const Actions&) = delete;
  Actions& operator=(const Actions&) = delete;
};

}  // namespace

Result<MemoryFile> MemoryFile::make(const char* name) {
  const int any = ::memfd_create(name, MFD_CLOEXEC);
  // The duplicate gets a number of 3 or higher, because the standard streams may be closed in this process. In the child it
  // becomes one of the standard streams.
  const int descriptor = any < 0 ? -1 : ::fcntl(any, F_DUPFD_CLOEXEC, 3);
  const int error = errno;
  if (any >= 0) ::close(any);
  if (descriptor < 0)
    return failure(ErrorKind::unavailable, std::string("a file in memory cannot be made: ") + std::strerror(error));
  return MemoryFile(descriptor);
}

MemoryFile::MemoryFile(MemoryFile&& other) noexcept : descriptor_(other.descriptor_) { other.descriptor_ = -1; }
MemoryFile::~MemoryFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<ChildEnd> run_child(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                           const MemoryFile& input, const MemoryFile& output, const MemoryFile& errors) {
  Actions child;
  int stream = 0;
  for (const MemoryFile* file : {&input, &output, &errors})
    posix_spawn_file_actions_adddup2(&child.actions, file->descriptor(), stream++);
  posix_spawn_file_actions_addclosefrom_np(&child.actions, stream);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&child.attributes, &none);
  posix_spawnattr_setsigdefault(&child.attributes, &all);
  posix_spawnattr_setpgroup(&child.attributes, 0);  // Ctrl-C must not end the child, because this process handles it
  posix_spawnattr_setflags(&child.attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);

  std::string name = program.string();
  std::vector<std::string> words = arguments;
  std::vector<char*> argv{name.data()};
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t pid = 0;
  if (const int error = ::posix_spawn(&pid, name.c_str(), &child.actions, &child.attributes, argv.data(), environ); error != 0)
    return failure(error == ENOENT ? ErrorKind::missing_file : ErrorKind::unavailable,
                   name + " cannot be started: " + std::strerror(error));
  int status = 0;
  pid_t ended = 0;
  while ((ended = ::waitpid(pid, &status, 0)) < 0 && errno == EINTR) {
  }
  if (ended < 0) return ChildEnd{.signal = 0, .exit_code = -1};
  if (WIFSIGNALED(status)) return ChildEnd{.signal = WTERMSIG(status), .exit_code = 0};
  return ChildEnd{.signal = 0, .exit_code = WEXITSTATUS(status)};
}

}  // namespace sonar
