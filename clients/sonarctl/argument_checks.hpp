// What values on sonarctl's command line may be, beside numbers and choices (core/text/arguments.hpp).
#pragma once

#include <string>

#include "protocol/control/pose_sample.hpp"

namespace CLI {
class App;
class Validator;
}  // namespace CLI

namespace sonar::clients {

/// HOST, HOST:PORT or :PORT.
CLI::Validator address();
CLI::Validator colour_map();

/// --frame: enu or ned, in small letters or capitals.
void add_frame_option(CLI::App& command, control::Frame& frame, const std::string& help);

}  // namespace sonar::clients
