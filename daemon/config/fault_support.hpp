// Determines which kinds of faults take effect on the sonars of a vendor.
#pragma once

#include <string>

#include "protocol/fault_kinds.hpp"

namespace sonar {

/// Returns the reason why the kind has no effect on sonars of this vendor; empty if it has an effect.
std::string why_without_effect(const FaultKind& kind, const protocol::Vendor& vendor);

/// Returns the table of kinds and vendors, whose cells are "takes effect" or the reason why not.
std::string support_table();

}  // namespace sonar
