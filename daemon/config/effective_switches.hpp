// Determines which parts of the model take effect: the comparison modes and the fixed fan leave out some parts even if their
// switches are on (docs/acoustics.md, section 8).
#pragma once

#include <string>

#include "core/sonar/ping.hpp"

namespace sonar {

/// Switches off the parts that take no effect; the pings are the same.
Switches effective_switches(Switches switches);

/// The reason why a part has no effect although its switch is on; empty if it has an effect.
std::string why_without_effect(const Switches& switches, const NamedSwitch& part);

/// One sentence that names the parts that are switched on but have no effect; empty if there are none.
std::string note_of_parts_left_out(const Switches& switches);

}  // namespace sonar
