// `sonard render`: renders pings into files, or reports coverage. docs/render.md is its manual.
#pragma once

#include "daemon/commands/options/command_line.hpp"

namespace sonar::render {

/// Errors: faults of the input or the folder.
Result<void> run_render(const RenderCommand& command);

}  // namespace sonar::render
