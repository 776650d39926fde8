// Ping1D: an altimeter with one wide beam. TCP and UDP; a host requests single measurements or a stream of them.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::ping::ping1d {

const protocol::Vendor& vendor();

}  // namespace sonar::ping::ping1d
