// Packets and files of a Sonar 3D-15, for recordings.
#pragma once

#include "protocol/recording/codec.hpp"

namespace sonar::waterlinked {

recording::Codec codec();

}  // namespace sonar::waterlinked
