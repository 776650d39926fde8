// Pictures whose neighbouring beams come from successive pings (docs/acoustics.md, section 6). The functions make the requests
// of these pings, select the beams that each ping forms, and combine the picture. A beam uses columns far beyond its own, so a
// ping skips fewer columns than beams: half of them if its beams are eight apart, hardly any if they are three apart.
#pragma once

#include <span>
#include <vector>

#include "core/pipeline/ping_plan.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

/// Number of pings in a picture. The request must be valid.
int pings_in(const PingRequest& picture);
/// The requests of a picture's pings in the order of firing. Each has its own time, pose and number; the number is a key of the
/// noise.
std::vector<PingRequest> pings_of(const PingRequest& picture);

/// A set of beams: first, first + step, ...
struct BeamChoice {
  int first = 0, step = 1;
  bool is_all() const { return step == 1; }
  bool has(int beam) const { return next(beam) == beam; }
  /// The first beam of the set that is not below `beam`.
  int next(int beam) const { return beam <= first ? first : first + (beam - first + step - 1) / step * step; }
};
/// The beams that ping `p` of a picture forms.
BeamChoice beams_of(const PingRequest& picture, std::size_t p);

/// A range of columns, [first, last).
struct ColumnRange {
  int first = 0, last = 0;
};
/// The columns that have a weight in these beams, as separate ranges in increasing order. The result is all columns if beams
/// contain parts of each other (crosstalk, mixed beams), or if a transform forms all beams.
std::vector<ColumnRange> columns_of(const PingPlan& plan, BeamChoice beams);

/// Combines the picture: each beam is copied from the ping that formed it. `pings`: the pings of pings_of(), in the same order.
Ping interleaved(const PingRequest& picture, std::span<Ping> pings);

}  // namespace sonar
