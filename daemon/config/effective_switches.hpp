// Determines which parts of the model take effect. The comparison modes and the fixed fan leave out some parts even if the
// switches of these parts are on (docs/acoustics.md, section 8).
#pragma once

#include <string>

#include "core/sonar/ping.hpp"

namespace sonar {

/// Switches off the parts that have no effect; this does not change the pings.
Switches effective_switches(Switches switches);

/// Returns the reason why a part has no effect although its switch is on; empty if it has an effect.
std::string why_without_effect(const Switches& switches, const NamedSwitch& part);

/// Returns one sentence that names the parts that are switched on but have no effect; empty if there are none.
std::string note_of_parts_left_out(const Switches& switches);

}  // namespace sonar
