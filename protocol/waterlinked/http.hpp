// The HTTP API of a Sonar 3D-15, "/api/v1/integration": JSON in, settings out. Pure functions.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::waterlinked {

protocol::ResourceReply answer(const protocol::ResourceRequest& request, const protocol::DeviceState& device, Time now);

}  // namespace sonar::waterlinked
