// Guesses the unit of time stamps if the file does not name it, from the steps between stamps and from the resulting speed.
#pragma once

#include <vector>

#include "core/base/geometry.hpp"

namespace sonar::motion {

/// The first lines of one body: the stamps, in an unknown unit, and the positions [m].
struct FirstLines {
  std::vector<double> stamps;
  std::vector<Vec3d> positions;
};

/// Returns N, 9, 6, 3 or 0, for a unit of 10^N ns. `usual` is the N of the file's format: 9 (seconds) or 0 (nanoseconds). The
/// result is `usual`, unless lines would then be implausibly far apart in time, or the unit is seconds and the body would move
/// slower than 5 mm/s. If the body rests, a file of ten or more lines is assumed to be a log, whose steps are short.
int unit_by_steps(const FirstLines& lines, int usual);

}  // namespace sonar::motion
