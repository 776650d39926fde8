// The period of pings that goes with a rate, as the family's devices and hosts write it.
#pragma once

#include <algorithm>

namespace sonar::ping {

/// The period for a rate above 0 [ms], limited to 1 to 30000.
inline double period_ms(double rate_hz) { return std::clamp(1000 / rate_hz, 1.0, 30000.0); }

}  // namespace sonar::ping
