// Waits for a device that may never answer. The code needs no device, so it can be tested.
#pragma once

namespace sonar::cuda {

// Longest wait [s]. A batch takes milliseconds. A service's watchdog ends the program after 30 s
// (daemon/systemd/sonard.service).
inline constexpr double longest_wait_s = 20;
// During this time [s] the device is queried without pauses, because a sleep would lengthen every ping.
inline constexpr double busy_wait_s = 0.02;

/// Calls `answer` until its result is not `not_yet`, and returns that result. After longest_wait_s it returns `hung`. `now` is
/// a clock [s]; `rest` sleeps for a short time.
template <class Code, class Answer, class Now, class Rest>
Code wait_for(Code not_yet, Code hung, const Answer& answer, const Now& now, const Rest& rest) {
  Code code = answer();
  if (code != not_yet) return code;
  const double begin = now();
  for (double waited = 0; (code = answer()) == not_yet; waited = now() - begin) {
    if (waited > longest_wait_s) return hung;
    if (waited > busy_wait_s) rest();
  }
  return code;
}

}  // namespace sonar::cuda
