// From a decoded Oculus ping to the picture the fan tools draw and measure.
#pragma once

#include "core/base/result.hpp"
#include "core/image/polar_image.hpp"
#include "protocol/oculus/decode.hpp"

namespace sonar::clients {

/// Samples as sent. Full scale: 254 for 8 bits (the devices' saturation); for wider samples, which rarely come near their
/// maximum, the value that one sample in a thousand exceeds. A sentence when the message does not hold its image.
Result<PolarImage> picture_of(const oculus::DecodedPing& ping);

}  // namespace sonar::clients
