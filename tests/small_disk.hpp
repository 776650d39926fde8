// Imitates a small disk, for tests of code that writes files: the files of this process may not grow any further.
// Used by the tests of recordings, those of protocol/recording and those inside the daemon.
#pragma once

#include <sys/resource.h>

#include <csignal>

namespace sonar {

/// While it exists, files may grow to this many bytes, as if the disk ended there.
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
