// The picture of a sonar whose head turns: a line by range for each direction, the newest of each.
#pragma once

#include <memory>
#include <vector>

#include "protocol/host.hpp"
#include "protocol/waterfall.hpp"

namespace sonar::protocol {

/// Cheap to copy.
class Sweep {
 public:
  /// `directions`: number of directions in a turn, at least 4. Direction 0 looks astern; the others follow over port, ahead and
  /// starboard.
  explicit Sweep(std::size_t directions) : lines_(directions) {}
  std::size_t directions() const { return lines_.size(); }
  /// Adds a line. If it has other rows than the lines before, those are dropped. `ping` gets the picture, which is whole when the
  /// half ahead has been scanned.
  void add(std::size_t direction, Line line, double row_m, HostPing& ping);

 private:
  double bearing_rad(std::size_t direction) const;
  std::size_t ahead_begin() const { return lines_.size() / 4; }
  std::size_t ahead_end() const { return lines_.size() - lines_.size() / 4 + 1; }
  /// The half ahead, as long as only that half was scanned.
  PolarImage shown() const;

  std::size_t rows_ = 0;
  double row_m_ = 0;
  std::vector<std::shared_ptr<const Line>> lines_;
};

}  // namespace sonar::protocol
