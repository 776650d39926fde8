#include "tests/own_network/own_network.hpp"

#include <fcntl.h>
#include <linux/capability.h>
#include <net/if.h>
#include <sched.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

namespace sonar::tests {
namespace {

bool write_to(const char* path, const std::string& text) {
  const int fd = open(path, O_WRONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool written = write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  return close(fd) == 0 && written;
}

bool loopback_up() {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ifreq lo{};
  std::strcpy(lo.ifr_name, "lo");
  lo.ifr_flags = IFF_UP | IFF_RUNNING;
  const bool up = fd >= 0 && ioctl(fd, SIOCSIFFLAGS, &lo) == 0;
  if (fd >= 0) close(fd);
  return up;
}

/// Drops all capabilities. A user namespace gives them to its first process, so that no permission would be refused in a test.
bool drop_capabilities() {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, 2> none{};
  return syscall(SYS_capset, &header, none.data()) == 0;
}

bool isolate() {
  if (unshare(CLONE_NEWNET) == 0) return loopback_up();  // root
  const std::string user = std::to_string(geteuid()), group = std::to_string(getegid());
  return unshare(CLONE_NEWUSER | CLONE_NEWNET) == 0 && write_to("/proc/self/setgroups", "deny") &&
         write_to("/proc/self/uid_map", user + " " + user + " 1") && write_to("/proc/self/gid_map", group + " " + group + " 1") &&
         loopback_up() && drop_capabilities();
}

/// Tries in a child process first, because some kernels allow the namespace but not its loopback interface, and a process cannot
/// leave it again.
bool may_isolate() {
  const pid_t child = fork();
  if (child == 0) _exit(isolate() ? 0 : 1);
  int status = 1;
  while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return child > 0 && status == 0;
}

/// Waits for the lock. The process holds it until it ends, also after it becomes another program by exec.
void wait_for_turn() {
  const std::string path = std::filesystem::temp_directory_path() / "sonard-tests.lock";
  int fd = open(path.c_str(), O_RDONLY);  // it may belong to another user
  if (fd < 0) fd = open(path.c_str(), O_RDONLY | O_CREAT, 0644);
  while (fd >= 0 && flock(fd, LOCK_EX) != 0 && errno == EINTR) {
  }
}

}  // namespace

void enter_own_network() {
  const char* const entered = "SONARD_OWN_NETWORK";
  if (getenv(entered) != nullptr) return;
  const bool forbidden = getenv("SONARD_SHARED_NETWORK") != nullptr;  // for the test of the code below
  if (forbidden || !may_isolate() || !isolate()) {
    std::fputs("no network namespaces here: tests that open sockets run one at a time\n", stderr);
    wait_for_turn();
  }
  setenv(entered, "1", 1);
}

}  // namespace sonar::tests
