// The current step of a long load. Code that reads and builds scenes sets it; a console shows it. There is one for the process.
#pragma once

#include <cstdint>
#include <string>

namespace sonar {

struct LoadStep {
  std::string what;  // "reading wreck.ply"; empty before the first, and while a step is short
  double part = 0;   // fraction that is done, 0 to 1; 0 = unknown
};

/// Any thread may call it. `triangles` is the approximate size of the step; below 300,000 it is short, and `what` stays empty.
void begin_load_step(std::string what, std::uint64_t triangles);
void load_step_reached(double part);
LoadStep load_step();

}  // namespace sonar
