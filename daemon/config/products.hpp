// Finds properties of products: defaults, and notes on options without effect. Also applies `sonard --profile`.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/sonar/ping.hpp"
#include "daemon/config/config.hpp"

namespace sonar {

/// Returns the first word of the vendor's product names, such as "Oculus", "BlueView" or "ARIS".
std::string title_of(const protocol::Vendor& vendor);

/// Returns the default number of observers: 0 for a product that accepts several clients or sends pings only over UDP.
int default_max_observers(const protocol::Vendor& vendor);

/// Returns a sentence for each option that the configuration gives to a sonar of another vendor, and for each trajectory file
/// whose origin is not world.origin. Such options have no effect but are allowed, so that a configuration stays valid if only the
/// `profile` of a sonar is changed.
std::vector<std::string> notes_of_config(const Config& config);

/// Changes the first sonar to this product, with the product's defaults. Errors list the products.
Result<void> use_product(Config& config, std::string_view profile);

// Determines which parts of the model take effect. The comparison modes and the fixed fan leave out some parts even if the
// switches of these parts are on (docs/acoustics.md, section 8).

/// Switches off the parts that have no effect; this does not change the pings.
Switches effective_switches(Switches switches);

/// Returns the reason why a part has no effect although its switch is on; empty if it has an effect.
std::string why_without_effect(const Switches& switches, const NamedSwitch& part);

/// Returns one sentence that names the parts that are switched on but have no effect; empty if there are none.
std::string note_of_parts_left_out(const Switches& switches);

}  // namespace sonar
