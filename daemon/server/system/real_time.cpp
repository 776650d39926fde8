#include "daemon/server/system/real_time.hpp"

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <exception>
#include <filesystem>
#include <system_error>
#include <thread>

namespace sonar {

std::string schedule_in_real_time(int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  if (sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters) == 0) return {};
  const int error = errno;
  return std::string("engine.io_priority has no effect: ") + std::strerror(error) +
         "; allow it with LimitRTPRIO=" + std::to_string(priority) +
         " in the service's unit, or: setcap cap_sys_nice+ep on the program";
}

void hurry_all_threads() {
  const int first = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::getpid()));
  std::error_code ec;
  for (std::filesystem::directory_iterator it("/proc/self/task", ec), end; !ec && it != end; it.increment(ec)) {
    id_t thread = 0;
    const std::string name = it->path().filename();
    std::from_chars(name.data(), name.data() + name.size(), thread);
    if (::setpriority(PRIO_PROCESS, thread, first) != 0 && errno != ESRCH) return;  // the process has no permission
  }
}

void compute_apart(const std::function<void()>& work) {
  std::exception_ptr fault;
  std::thread([&] {
    if (::nice(background_niceness) == -1) {
      // On Linux niceness belongs to the thread. If setting it fails, the thread keeps its priority.
    }
    try {
      work();
    } catch (...) {
      fault = std::current_exception();
    }
  }).join();
  if (fault) std::rethrow_exception(fault);
}

}  // namespace sonar
