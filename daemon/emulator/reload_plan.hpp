// Outcome of a reload for running sonars. Pure.
#pragma once

#include <vector>

#include "daemon/config/config.hpp"

namespace sonar {

/// untouched and moved: it keeps its clients; changed: it is replaced; removed: it stops.
enum class SonarChange { untouched, moved, changed, removed };
/// Change of a sonar that runs as `running`, when `next` takes the place of `now`.
SonarChange sonar_change(const SonarConfig& running, const Config& now, const Config& next);

/// Returns null if there is none.
const SonarConfig* sonar_named(const std::vector<SonarConfig>& sonars, const std::string& name);

}  // namespace sonar
