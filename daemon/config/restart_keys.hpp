// Which keys of a configuration that was read again take effect at the next restart only. Pure; used when App reloads.
#pragma once

#include <string>
#include <vector>

#include "daemon/config/config.hpp"

namespace sonar {

/// Copies into `next` the values of `now` that only a restart can change; returns the keys whose values were different.
std::vector<std::string> keep_restart_keys(const Config& now, Config& next);

}  // namespace sonar
