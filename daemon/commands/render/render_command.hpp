// `sonard render`: renders pings into files, reports coverage, or checks what a render file expects. docs/render.md is its
// manual.
#pragma once

#include "daemon/commands/command_line.hpp"

namespace sonar::render {

/// The exit code: 0; 1 when an expectation is not met; else that of the error, which has been printed.
int run_render(const RenderCommand& command);

}  // namespace sonar::render
