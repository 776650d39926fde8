// Scheduling of the daemon's threads: the I/O thread comes first, on request with real-time priority, and computing threads after
// it.
#pragma once

#include <functional>
#include <string>

namespace sonar {

/// Niceness of the threads that compute pings: of equals the I/O thread goes first. More would leave pings little beside programs
/// that never sleep, which at +10 take nine tenths of their core.
inline constexpr int compute_niceness = 1;
/// Niceness of threads that no ping waits for: building a scene, recording.
inline constexpr int background_niceness = 10;

/// The calling thread runs before all others of the computer that are not scheduled so (SCHED_FIFO); threads it starts do not.
/// `priority` 1 to 99. Empty, or a sentence: why not, and what to do.
std::string schedule_in_real_time(int priority);

/// Runs `work` on a thread of its own in the background, and waits for it. Threads that `work` starts are as nice as that one:
/// Embree's builders, which live on. Exceptions pass through.
void compute_apart(const std::function<void()>& work);

}  // namespace sonar
