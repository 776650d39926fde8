// Which kinds of faults take effect on the sonars of a vendor.
#pragma once

#include <string>

#include "daemon/config/faults/kinds.hpp"

namespace sonar {

/// Empty when it takes effect on sonars of this vendor; else why not.
std::string why_without_effect(const FaultKind& kind, const protocol::Vendor& vendor);

/// The table of kinds by vendors, as text: "takes effect" or why not.
std::string support_table();

}  // namespace sonar
