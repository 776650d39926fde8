// What of a configuration that was read again can be taken over by the running daemon, and what needs a restart.
// Pure; App::reload puts it to use.
#pragma once

#include <string>
#include <vector>

#include "daemon/config/config.hpp"

namespace sonar {

/// Puts into `next` what only a restart can change, as it is in `now`; returns the keys that would have been different.
std::vector<std::string> keep_what_needs_a_restart(const Config& now, Config& next);

bool is_same(const Water& a, const Water& b);

}  // namespace sonar
