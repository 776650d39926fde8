// `sonard render`: renders pings into files, reports coverage, or checks what a render file expects. docs/render.md is its
// manual.
#pragma once

#include "daemon/commands/options/command_line.hpp"

namespace sonar::render {

/// The exit code: 0, or 1 when an expectation is not met. Errors: what the input or the folder has wrong.
Result<int> run_render(const RenderCommand& command);

}  // namespace sonar::render
