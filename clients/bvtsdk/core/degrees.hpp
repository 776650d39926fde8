// Angles of the libraries' interface are in degrees, those inside in radians.
#pragma once

namespace sonar::bvt {

inline constexpr double degrees = 57.29577951308232;  // degrees in a radian

}  // namespace sonar::bvt
