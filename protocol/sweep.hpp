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
  /// At least 4 directions of a turn: 0 looks astern, the next ones over port back to astern.
  explicit Sweep(std::size_t directions) : lines_(directions) {}
  std::size_t directions() const { return lines_.size(); }
  /// Begins anew where the rows are others. `ping` gets the picture, which is whole once the half ahead was scanned.
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
