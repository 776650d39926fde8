// Decides which parts of the model take effect. The comparison modes and the fixed fan leave some parts out even if their
// switches are on (docs/acoustics.md, section 8). Used by every reader of switches, and by the JSON of a rendered ping.
#pragma once

#include <string>

#include "core/sonar/ping.hpp"

namespace sonar {

/// The switches without the parts that take no effect. Pings made with the result are the same.
Switches effective_switches(Switches switches);

/// Why a part has no effect although its switch is on; empty if it has one.
std::string why_without_effect(const Switches& switches, const NamedSwitch& part);

/// One sentence that names the parts whose switches are on but which have no effect; empty if there is none.
std::string note_of_parts_left_out(const Switches& switches);

}  // namespace sonar
