// Schedules the daemon's threads: the I/O thread has priority (real-time priority on request) over computing threads.
#pragma once

#include <functional>
#include <string>

namespace sonar {

/// Niceness of the threads that compute pings, so that the I/O thread has priority over them. With a much higher value the
/// threads would get too little time: at +10, other busy programs would get nine tenths of a shared core.
inline constexpr int compute_niceness = 1;
/// Niceness of threads for which no ping waits, such as those that build a scene or record.
inline constexpr int background_niceness = 10;

/// Gives the calling thread real-time priority (SCHED_FIFO), which threads that it starts do not inherit. `priority` 1 to 99.
/// Returns an empty text, or a sentence with the reason of a failure and the remedy.
std::string schedule_in_real_time(int priority);

/// Sets the niceness of all threads of the process to that of the first thread, because each thread needs processor time to end:
/// on a busy computer, a thread at +10 took seconds to free the memory. The process needs the limit LimitNICE= of the unit, or
/// CAP_SYS_NICE.
void hurry_all_threads();

/// Runs `work` on a separate background thread, and waits for it. Threads that `work` starts inherit the niceness, for example
/// the threads of Embree, which do not end with it. Exceptions are passed on to the caller.
void compute_apart(const std::function<void()>& work);

}  // namespace sonar
