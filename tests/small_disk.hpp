// Imitates a small disk, for tests of code that writes files: it limits the size of this process's files.
// The tests of protocol/recording and of the daemon's recordings use it.
#pragma once

#include <sys/resource.h>

#include <csignal>

namespace sonar {

/// While an object exists, no file can grow beyond this number of bytes, as if the disk were full.
class SmallDisk {
 public:
  explicit SmallDisk(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallDisk() { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

}  // namespace sonar
