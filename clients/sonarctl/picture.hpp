// Converts a decoded ping to the image that the fan tools draw and measure.
#pragma once

#include "clients/sonarctl/any_ping.hpp"
#include "core/base/result.hpp"
#include "core/image/polar_image.hpp"

namespace sonar::clients {

/// Samples as sent. Full scale: 254 for 8 bits (the devices' saturation); for wider samples, which rarely come near their
/// maximum, the value that one sample in a thousand exceeds; of BlueView heads, whose weak echoes no gamma lifts, one in a
/// hundred; 255 of an ARIS or a Ping360. Error when the message does not hold its image.
Result<PolarImage> picture_of(const AnyPing& ping);

}  // namespace sonar::clients
