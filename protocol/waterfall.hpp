// The picture of a sonar whose pings are lines by range: one below the other, the newest on top.
#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "protocol/host.hpp"

namespace sonar::protocol {

using Line = std::vector<float>;  // by range, [dB]

/// The lines of the last pings.
class Waterfall {
 public:
  /// Adds a line. If it has other rows than the lines before, those are dropped. `ping` gets the drawing.
  void add(Line line, double start_m, double row_m, HostPing& ping);

 private:
  std::deque<std::shared_ptr<const Line>> lines_;
  double start_m_ = 0, row_m_ = 0;
};

}  // namespace sonar::protocol
