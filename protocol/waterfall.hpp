// The picture of a sonar whose pings are single lines: one below the other, the newest on top.
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
  /// Adds a line and puts the drawing into `ping`. If the rows differ from those of earlier lines, the earlier lines are
  /// dropped.
  void add(Line line, double start_m, double row_m, HostPing& ping);

 private:
  std::deque<std::shared_ptr<const Line>> lines_;
  double start_m_ = 0, row_m_ = 0;
};

}  // namespace sonar::protocol
