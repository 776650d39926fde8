// sonard: parses the command line, runs the command, and turns its errors and exceptions into a line and an exit code.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>

#include <sys/resource.h>
#include <unistd.h>

#include "core/base/program_start.hpp"
#include "core/text/format.hpp"
#include "daemon/commands/options/commands.hpp"
#include "daemon/server/system/log.hpp"
#include "daemon/server/system/shortage.hpp"

namespace sonar {
namespace {

/// Writes the error to standard error: as a JSON line of the log if `json`, else as plain text. Returns the exit code.
int report_error(const Error& error, bool json) {
  LogOptions options;
  options.json = true;
  if (json)
    Log(options).error(error.text);
  else
    std::fprintf(stderr, "sonard: %s\n", text::printable(error.text).c_str());
  return exit_code(error.kind);
}

/// Called for an exception in a thread of a library, which no caller can catch, and for a running thread without owner. Embree
/// leaves such a thread if a limit on memory or threads prevents the start of the others.
[[noreturn]] void end_at_once() {
  constexpr rlim_t few_threads = 1024;
  rlimit memory{RLIM_INFINITY, RLIM_INFINITY}, threads{RLIM_INFINITY, RLIM_INFINITY};
  ::getrlimit(RLIMIT_AS, &memory);
  ::getrlimit(RLIMIT_NPROC, &threads);
  const bool is_limited = memory.rlim_cur != RLIM_INFINITY || threads.rlim_cur < few_threads;
  const char* why = is_limited ? not_enough_threads : nullptr;
  try {
    if (const std::exception_ptr e = std::current_exception()) std::rethrow_exception(e);
  } catch (const std::bad_alloc&) {
    why = not_enough_memory;
  } catch (const std::exception& e) {
    if (!is_short_of_threads(e)) why = nullptr;
  } catch (...) {
    why = nullptr;
  }
  if (why == nullptr) {
    __gnu_cxx::__verbose_terminate_handler();
    std::abort();
  }
  std::fprintf(stderr, "sonard: %s\n", why);
  ::_exit(exit_code(ErrorKind::unavailable));
}

Result<int> code_of(const Result<void>& done) {
  if (!done) return tl::make_unexpected(done.error());
  return 0;
}

/// Returns the exit code. Sets `json` if the caller must write errors as JSON, thrown exceptions included.
Result<int> run_command(const Command& command, std::chrono::steady_clock::time_point begin, bool& json) {
  if (const auto* leave = std::get_if<Leave>(&command)) return leave->exit_code;  // after --help, --version or a reported error
  if (const auto* check = std::get_if<CheckCommand>(&command)) return code_of(run_check(*check));
  if (const auto* render = std::get_if<RenderCommand>(&command)) return code_of(render::run_render(*render));
  if (const auto* dataset = std::get_if<DatasetCommand>(&command)) return dataset::run_dataset(*dataset);
  if (const auto* worker = std::get_if<WorkerCommand>(&command)) return farm::run_worker(*worker);
  if (const auto* on_farm = std::get_if<FarmCommand>(&command)) return farm::run_farm(*on_farm);
  if (const auto* replay = std::get_if<ReplayCommand>(&command)) {
    json = replay->json;
    return code_of(run_replay(*replay));
  }
  return run_daemon(std::get<RunCommand>(command), begin, json);
}

}  // namespace
}  // namespace sonar

int main(int argc, char** argv) {
  sonar::open_closed_standard_streams();
  std::set_terminate(sonar::end_at_once);
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond the limit of file sizes (ulimit -f) fails, and does not end the program
  const auto begin = std::chrono::steady_clock::now();
  bool json = false;
  if (const auto room = sonar::make_room_for_stacks(); !room) return sonar::report_error(room.error(), json);
  try {
    const auto command = sonar::parse_command_line(argc, argv);
    const auto code = sonar::run_command(command, begin, json);
    if (!code) return sonar::report_error(code.error(), json);
    const auto printed = sonar::flush_standard_output();
    const bool is_lost =
        !printed && *code == 0 && !std::holds_alternative<sonar::RunCommand>(command);  // the daemon writes a log
    return is_lost ? sonar::report_error(printed.error(), json) : *code;
  } catch (const std::bad_alloc&) {
    return sonar::report_error({sonar::ErrorKind::unavailable, sonar::not_enough_memory}, json);
  } catch (const std::exception& e) {
    if (sonar::is_short_of_threads(e))
      return sonar::report_error({sonar::ErrorKind::unavailable, sonar::not_enough_threads}, json);
    return sonar::report_error({sonar::ErrorKind::bug, std::string(e.what()) + " (this is a bug, please report it)"}, json);
  }
}
