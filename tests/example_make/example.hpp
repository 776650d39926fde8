// The Example, a make of sonar that tests add to the product's makes. Its folder is
// like protocol/<make>/.
#pragma once

#include "protocol/host.hpp"

namespace sonar::example_make {

const protocol::Vendor& vendor();
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();

}  // namespace sonar::example_make
