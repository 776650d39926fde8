// Frames and files of an ARIS, for recordings.
#pragma once

#include "protocol/recording/codec.hpp"

namespace sonar::aris {

recording::Codec codec();

}  // namespace sonar::aris
