#include "core/base/standard_streams.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace sonar {

void open_closed_standard_streams() {
  // open() returns the lowest free number, which is the number of the closed stream.
  for (int fd = STDIN_FILENO; fd <= STDERR_FILENO; ++fd)
    if (::fcntl(fd, F_GETFD) == -1 && errno == EBADF && ::open("/dev/null", O_RDWR) != fd) return;
}

bool standard_error_is_blocked() {
  pollfd error{STDERR_FILENO, POLLOUT, 0};
  return ::poll(&error, 1, 0) == 0;
}

Result<void> flush_standard_output() {
  const bool flushed = std::fflush(stdout) == 0;
  const std::string why = flushed ? "an earlier line is lost" : std::strerror(errno);
  if (flushed && std::ferror(stdout) == 0) return {};
  pollfd output{STDOUT_FILENO, POLLOUT, 0};
  if (::poll(&output, 1, 0) == 1 && (output.revents & POLLERR) != 0) return {};
  return failure(ErrorKind::io, "standard output cannot be written: " + why + "; the printed text is incomplete");
}

}  // namespace sonar
