// What a long load is at: the readers and builders of scenes tell it, a console asks for it, and neither knows the other.
// One for the process.
#pragma once

#include <cstdint>
#include <string>

namespace sonar {

struct LoadStep {
  std::string what;  // "reading wreck.ply"; empty before the first
  double part = 0;   // of it that is done, 0 to 1; 0 = not known
};

/// From any thread. `triangles`: about how many it is for; a step for fewer than 300,000 is not worth telling.
void begin_load_step(std::string what, std::uint64_t triangles);
void load_step_reached(double part);
LoadStep load_step();

}  // namespace sonar
