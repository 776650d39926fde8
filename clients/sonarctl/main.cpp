// sonarctl: the tool for users of a sonar.
#include <csignal>
#include <cstdio>

#include "clients/sonarctl/command_line.hpp"
#include "core/base/program_start.hpp"

int main(int argc, char** argv) {
  struct sigaction on_interrupt {};
  on_interrupt.sa_handler = [](int) { sonar::clients::interrupted = 1; };
  on_interrupt.sa_flags = static_cast<int>(
      SA_RESETHAND);  // a second Ctrl-C ends commands that do not check `interrupted`, such as a check of a scene
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
