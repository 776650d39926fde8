// Frames and logs of the ping protocol, for recordings.
#pragma once

#include "protocol/recording/codec.hpp"

namespace sonar::ping {

namespace ping360 {
recording::Codec codec();
}
namespace surveyor {
recording::Codec codec();
}
namespace omniscan {
recording::Codec codec();
}

}  // namespace sonar::ping
