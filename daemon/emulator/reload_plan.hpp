// Determines what a reload of the configuration does to running sonars.
#pragma once

#include <vector>

#include "daemon/config/config.hpp"

namespace sonar {

/// untouched and moved sonars keep their clients; a changed one is replaced; a removed one stops.
enum class SonarChange { untouched, moved, changed, removed };
/// Returns the change of the sonar `running` if configuration `next` replaces `now`.
SonarChange sonar_change(const SonarConfig& running, const Config& now, const Config& next);

/// Returns null if there is no sonar with this name.
const SonarConfig* sonar_named(const std::vector<SonarConfig>& sonars, const std::string& name);

}  // namespace sonar
