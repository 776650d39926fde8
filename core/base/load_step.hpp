// What a long load is at: the readers and builders of scenes tell it, a console asks for it, and neither knows the other.
// One for the process.
#pragma once

#include <string>

namespace sonar {

struct LoadStep {
  std::string what;  // "reading wreck.ply"; empty before the first
  double part = 0;   // of it that is done, 0 to 1; 0 = not known
};

/// From any thread.
void begin_load_step(std::string what);
void load_step_reached(double part);
LoadStep load_step();

}  // namespace sonar
