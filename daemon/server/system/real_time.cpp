#include "daemon/server/system/real_time.hpp"

#include <sched.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <exception>
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

void compute_apart(const std::function<void()>& work) {
  std::exception_ptr fault;
  std::thread([&] {
    if (::nice(background_niceness) == -1) {
      // On Linux niceness belongs to the thread; a refusal costs only smoothness.
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
