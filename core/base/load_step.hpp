// The present step of a long load. The readers and builders of scenes set it, a console reads it. The process has one.
#pragma once

#include <cstdint>
#include <string>

namespace sonar {

struct LoadStep {
  std::string what;  // "reading wreck.ply"; empty before the first, and while a step is short
  double part = 0;   // share that is done, 0 to 1; 0 = not known
};

/// From any thread. `triangles`: about how many it is for; a step for fewer than 300,000 is short, and leaves `what` empty.
void begin_load_step(std::string what, std::uint64_t triangles);
void load_step_reached(double part);
LoadStep load_step();

}  // namespace sonar
