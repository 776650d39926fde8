// Guesses the unit of time stamps if the file does not name it, from the steps between stamps and from the resulting speed.
#pragma once

#include <vector>

#include "core/base/geometry.hpp"

namespace sonar::motion {

/// The stamps, as numbers of an unknown unit, and the positions [m] of the first lines of one body.
struct FirstLines {
  std::vector<double> stamps;
  std::vector<Vec3d> positions;
};

/// The unit is 10^N ns; returns N: 9, 6, 3 or 0. `usual` is the N of the file's format: 9 (seconds) or 0 (nanoseconds). It is
/// kept unless lines would be implausibly far apart in time, or, with seconds, the body would move slower than 5 mm/s. If the
/// body rests, ten or more lines are assumed to be a log, whose steps are short.
int unit_by_steps(const FirstLines& lines, int usual);

}  // namespace sonar::motion
