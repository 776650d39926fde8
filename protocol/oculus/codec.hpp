// Messages and log files of an Oculus, for recordings.
#pragma once

#include "protocol/recording/codec.hpp"

namespace sonar::oculus {

extern const recording::Framing framing;
recording::Codec codec();

}  // namespace sonar::oculus
