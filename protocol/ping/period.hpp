// Converts a ping rate to a period, which devices and hosts of the family use.
#pragma once

#include <algorithm>

namespace sonar::ping {

/// The period for a rate above 0 [ms], limited to 1 to 30000.
inline double period_ms(double rate_hz) { return std::clamp(1000 / rate_hz, 1.0, 30000.0); }

}  // namespace sonar::ping
