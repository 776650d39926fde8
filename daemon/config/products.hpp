// What follows from the choice of a product: which vendor's options count, and the demo with another sonar than its own.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"

namespace sonar {

/// "Oculus", "BlueView": as the names of the vendor's products begin.
std::string title_of(const protocol::Vendor& vendor);

/// Places for those who only look on: none of a product that has places for several clients.
int default_max_observers(const protocol::Vendor& vendor);

/// A sentence for each option that the configuration gives to a sonar of another vendor. Such options have no effect: a
/// configuration stays valid when only its `profile` is changed.
std::vector<std::string> notes_of_options(const Config& config);

/// Makes the first sonar that product, with the product's defaults of everything that depends on it. Errors list the products.
Result<void> use_product(Config& config, std::string_view profile);

}  // namespace sonar
