// Frames of sonard's BlueView link, for recordings. The vendor's own files belong to its libraries.
#pragma once

#include "protocol/recording/codec.hpp"

namespace sonar::blueview {

recording::Codec codec();

}  // namespace sonar::blueview
