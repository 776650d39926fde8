// The current step of a long load. Code that reads and builds scenes sets it; the console shows it. The process has only one.
#pragma once

#include <cstdint>
#include <string>

namespace sonar {

struct LoadStep {
  std::string what;  // "reading wreck.ply"; empty before the first step and during short steps
  double part = 0;   // fraction that is done, 0 to 1; 0 = unknown
};

/// Any thread may call it. `triangles` is the approximate size of the step; a step of fewer than 300,000 is short and leaves
/// `what` empty.
void begin_load_step(std::string what, std::uint64_t triangles);
void load_step_reached(double part);
LoadStep load_step();

}  // namespace sonar
