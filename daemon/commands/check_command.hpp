// `sonard check`: validates a configuration and its scene, and prints its content and probable mistakes.
#pragma once

#include "daemon/commands/options/command_line.hpp"

namespace sonar {

/// Errors: those of the configuration, the control token and the scene.
Result<void> run_check(const CheckCommand& command);

}  // namespace sonar
