// Pictures of sonars that send no fans: a waterfall, the sweep of a turning head, and the empty fan on which points are drawn.
#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "protocol/host.hpp"

namespace sonar::protocol {

using Line = std::vector<float>;  // levels in the order of range [dB]

/// Returns a fan without echoes, from `half_rad` to port to `half_rad` to starboard.
PolarImage empty_fan(double half_rad, double range_m);

/// The lines of the last pings, one below the other, the newest on top.
class Waterfall {
 public:
  /// `shown_db`: levels down to this far below the strongest echo are shown.
  explicit Waterfall(float shown_db = 60) : shown_db_(shown_db) {}
  /// Adds a line and puts the drawing of all lines into `ping`. The drawing has the ranges of this line; earlier lines, which may
  /// have had other ranges, are resampled. `received_at`: for the times beside the picture.
  void add(Line line, double start_m, double row_m, Time received_at, HostPing& ping);

 private:
  struct Row {
    std::shared_ptr<const Line> line;
    double start_m, row_m;
    Time received_at;
  };
  static float level_between(const Row& row, double from_m, double to_m);
  static SonarPicture picture_of(const std::deque<Row>& rows, float shown_db);

  float shown_db_;
  std::deque<Row> rows_;
};

/// The newest line of each direction of a turning head. Copies are cheap.
class Sweep {
 public:
  /// `directions`: number of directions in a turn, at least 4. Direction 0 is astern; the next directions are to port, ahead and
  /// to starboard.
  explicit Sweep(std::size_t directions) : lines_(directions) {}
  std::size_t directions() const { return lines_.size(); }
  /// Adds a line and puts the picture into `ping`; the picture is complete once the half circle ahead has been scanned. If the
  /// rows differ from those of earlier lines, the earlier lines are dropped.
  void add(std::size_t direction, Line line, double row_m, HostPing& ping);

 private:
  double bearing_rad(std::size_t direction) const;
  std::size_t ahead_begin() const { return lines_.size() / 4; }
  std::size_t ahead_end() const { return lines_.size() - lines_.size() / 4 + 1; }
  /// Returns the picture to show: the half circle ahead while only that half was scanned, else the full circle.
  PolarImage shown() const;

  std::size_t rows_ = 0;
  double row_m_ = 0;
  std::vector<std::shared_ptr<const Line>> lines_;
};

}  // namespace sonar::protocol
