#include "core/base/program_start.hpp"

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>
#include <algorithm>
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

namespace {

constexpr std::size_t least_stack_bytes = std::size_t{1} << 20;

/// Without this call, new threads would get the soft limit that the program was started with, even after it was raised.
void give_threads_the_usual_size() {
  pthread_attr_t attributes;
  std::size_t bytes = 0;
  if (::pthread_getattr_default_np(&attributes) != 0) return;
  if (::pthread_attr_getstacksize(&attributes, &bytes) == 0 && bytes < least_stack_bytes &&
      ::pthread_attr_setstacksize(&attributes, usual_stack_bytes) == 0)
    ::pthread_setattr_default_np(&attributes);
  ::pthread_attr_destroy(&attributes);
}

}  // namespace

Result<void> make_room_for_stacks() {
  give_threads_the_usual_size();
  rlimit limit{};
  if (::getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur >= usual_stack_bytes) return {};
  const rlim_t given = limit.rlim_cur;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, usual_stack_bytes);
  const rlim_t now = ::setrlimit(RLIMIT_STACK, &limit) == 0 ? limit.rlim_cur : given;
  if (now >= least_stack_bytes) return {};
  return failure(ErrorKind::unavailable, "the stack is limited to " + std::to_string(now >> 10) + " KiB, and at least " +
                                             std::to_string(least_stack_bytes >> 10) +
                                             " are needed; raise the limit (ulimit -s 8192, LimitSTACK=8M of the unit)");
}

}  // namespace sonar
