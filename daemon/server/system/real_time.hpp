// Scheduling of the daemon's threads: the I/O thread comes first, on request with real-time priority, and computing threads after
// it.
#pragma once

#include <functional>
#include <string>

namespace sonar {

/// Niceness of the threads that compute pings, so that the I/O thread has priority over them. More would be too much: at +10,
/// busy programs take nine tenths of a shared core.
inline constexpr int compute_niceness = 1;
/// Niceness of threads that no ping waits for: building a scene, recording.
inline constexpr int background_niceness = 10;

/// Gives the calling thread real-time priority (SCHED_FIFO), which threads that it starts do not inherit. `priority` 1 to 99.
/// Returns an empty text, or a sentence with the reason of a failure and the remedy.
std::string schedule_in_real_time(int priority);

/// Runs `work` on a thread of its own in the background, and waits for it. Threads that `work` starts inherit its
/// niceness, for example the builder threads of Embree, which are not ended. Exceptions are passed on to the caller.
void compute_apart(const std::function<void()>& work);

}  // namespace sonar
