// Finds the keys of a reloaded configuration that have an effect only after the next restart.
#pragma once

#include <string>
#include <vector>

#include "daemon/config/config.hpp"

namespace sonar {

/// Copies into `next` the values of `now` that only a restart can change; returns the keys whose values were different.
std::vector<std::string> keep_restart_keys(const Config& now, Config& next);

}  // namespace sonar
