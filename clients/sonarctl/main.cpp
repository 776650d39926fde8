// sonarctl: the tool for users of a sonar.
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <ctime>

#include "clients/sonarctl/command_line.hpp"
#include "core/base/program_start.hpp"

namespace {

/// The first signal sets `interrupted`, and the command ends in order. A later one ends the program, because some commands do not
/// check `interrupted`, such as a check of a scene. `timeout` sends two signals in a row, to the program and to its group.
void on_signal(int number) {
  static std::atomic<std::int64_t> first_ms;
  static_assert(std::atomic<std::int64_t>::is_always_lock_free);
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const std::int64_t now_ms = std::int64_t{1000} * now.tv_sec + now.tv_nsec / 1'000'000;
  std::int64_t first = 0;
  if (first_ms.compare_exchange_strong(first, now_ms)) {
    sonar::clients::interrupted = 1;
  } else if (now_ms > first + 500) {
    std::signal(number, SIG_DFL);
    std::raise(number);
  }
}

}  // namespace

int main(int argc, char** argv) {
  struct sigaction on_interrupt {};
  on_interrupt.sa_handler = on_signal;
  sigaction(SIGINT, &on_interrupt, nullptr);
  sigaction(SIGTERM, &on_interrupt, nullptr);
  struct sigaction on_hangup {};
  sigaction(SIGHUP, nullptr, &on_hangup);
  if (on_hangup.sa_handler != SIG_IGN) sigaction(SIGHUP, &on_interrupt, nullptr);  // nohup makes it ignored
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond the limit of file sizes (ulimit -f) fails, and does not end the program
  sonar::open_closed_standard_streams();
  if (const auto room = sonar::make_room_for_stacks(); !room) {
    std::fprintf(stderr, "sonarctl: %s\n", room.error().text.c_str());
    return sonar::exit_code(room.error().kind);
  }
  return sonar::clients::run(argc, argv);
}
