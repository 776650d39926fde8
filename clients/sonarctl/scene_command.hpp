// `sonarctl scene check|info|import` on the command line; what they do is in clients/scene_tools.
#pragma once

#include <functional>

#include "core/base/result.hpp"

namespace CLI {
class App;
}

namespace sonar::clients {

/// Adds its options; the answer does what was asked for.
std::function<Result<void>()> add_scene(CLI::App& app);

}  // namespace sonar::clients
