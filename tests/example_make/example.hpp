// The Example, a make of sonar that tests add to the product's makes: it has a folder like protocol/<make>/ and a row in the
// list.
#pragma once

#include "protocol/host.hpp"

namespace sonar::example_make {

const protocol::Vendor& vendor();
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();

}  // namespace sonar::example_make
