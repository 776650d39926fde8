// The interface of the libraries has angles in degrees; the code inside uses radians.
#pragma once

namespace sonar::bvt {

inline constexpr double degrees = 57.29577951308232;  // degrees in a radian

}  // namespace sonar::bvt
