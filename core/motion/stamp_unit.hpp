// Guesses the unit of stamps that a trajectory file does not name, from their steps and from the speed that follows.
#pragma once

#include <vector>

#include "core/base/geometry.hpp"

namespace sonar::motion {

/// The stamps, as numbers of an unknown unit, and the positions [m] of the first lines of one body.
struct FirstLines {
  std::vector<double> stamps;
  std::vector<Vec3d> positions;
};

/// The unit is 10^N ns; returns N: 9, 6, 3 or 0. `usual` is that of the file's format: 9 (seconds) or 0 (nanoseconds). It is
/// kept unless lines would be implausibly far apart, or, with seconds, the body would move slower than 5 mm/s. The steps of ten
/// and more lines of a body that rests are those of a log.
int unit_by_steps(const FirstLines& lines, int usual);

}  // namespace sonar::motion
