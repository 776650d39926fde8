// Scheduling of the daemon's threads: the I/O thread first, by wish in real time, and whatever computes after it.
#pragma once

#include <functional>
#include <string>

namespace sonar {

/// Niceness of every thread that computes: pool, simulation, building a scene.
inline constexpr int compute_niceness = 10;

/// The calling thread runs before all others of the computer that are not scheduled so (SCHED_FIFO); threads it starts do not.
/// `priority` 1 to 99. Empty, or a sentence: why not, and what to do.
std::string schedule_in_real_time(int priority);

/// Runs `work` on a thread of its own that computes, and waits for it. Threads that `work` starts are as nice as that one:
/// Embree's builders, which live on. Exceptions pass through.
void compute_apart(const std::function<void()>& work);

}  // namespace sonar
