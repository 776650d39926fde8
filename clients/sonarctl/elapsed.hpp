// Times that do not jump when the computer's clock is set.
#pragma once

#include <chrono>

#include "core/base/units.hpp"

namespace sonar::clients {

inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Computes UNIX time from the computer's clock at construction and the steady clock since then.
class UnixTime {
 public:
  Time now() const { return began_at_ + (std::chrono::steady_clock::now() - began_); }

 private:
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  Time began_at_ = std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now());
};

}  // namespace sonar::clients
