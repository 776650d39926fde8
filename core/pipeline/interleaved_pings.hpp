// Pictures whose neighbouring beams come from successive pings (docs/acoustics.md, section 6): the requests of these pings, the
// beams that each of them forms, and the combined picture. A beam uses columns far beyond its own, so a ping can skip few
// columns: half if its beams are eight apart, hardly any if they are three apart.
#pragma once

#include <span>
#include <vector>

#include "core/pipeline/ping_plan.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

/// Number of pings in a picture. The request must be valid.
int pings_in(const PingRequest& picture);
/// The requests of a picture's pings in the order of firing, each with its own time, pose, and number, which is a key of the
/// noise.
std::vector<PingRequest> pings_of(const PingRequest& picture);

/// The beams first, first + step, ...
struct BeamChoice {
  int first = 0, step = 1;
  bool is_all() const { return step == 1; }
  bool has(int beam) const { return next(beam) == beam; }
  /// The first chosen beam from `beam` on.
  int next(int beam) const { return beam <= first ? first : first + (beam - first + step - 1) / step * step; }
};
/// The beams of ping `p` of a picture.
BeamChoice beams_of(const PingRequest& picture, std::size_t p);

/// Columns [first, last).
struct ColumnRange {
  int first = 0, last = 0;
};
/// The columns that have a weight in these beams, as increasing, separate ranges. If beams contain parts of each other
/// (crosstalk, mixed beams), or a transform forms all beams, these are all columns.
std::vector<ColumnRange> columns_of(const PingPlan& plan, BeamChoice beams);

/// Combines the picture; each beam is taken from its ping. `pings`: the pings of pings_of(), in the same order.
Ping interleaved(const PingRequest& picture, std::span<Ping> pings);

}  // namespace sonar
