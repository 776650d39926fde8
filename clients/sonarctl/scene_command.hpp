// `sonarctl scene check|info|import` on the command line; implemented in clients/scene_tools.
#pragma once

#include <functional>

#include "core/base/result.hpp"

namespace CLI {
class App;
}

namespace sonar::clients {

/// Adds its options; returns the function that executes the command.
std::function<Result<void>()> add_scene(CLI::App& app);

}  // namespace sonar::clients
