// Finds out which parts of the model have an effect together: the comparison modes and the fixed fan leave some out whatever
// their switches say (docs/acoustics.md, section 8). Used by every reader of switches, and by the sidecar, which records the
// parameters of a ping.
#pragma once

#include <string>

#include "core/sonar/ping.hpp"

namespace sonar {

/// The same pings by switches that are all true: parts that take no effect are off.
Switches effective_switches(Switches switches);

/// Why a part does nothing in spite of its switch; empty where it takes effect.
std::string why_without_effect(const Switches& switches, const NamedSwitch& part);

/// One sentence that names the parts that are on and do nothing; empty when there is none.
std::string note_of_parts_left_out(const Switches& switches);

}  // namespace sonar
