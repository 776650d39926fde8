// The current step of a long load. Code that reads and builds scenes sets the step; the console shows it. The process has only
// one such step at a time.
#pragma once

#include <cstdint>
#include <string>

namespace sonar {

struct LoadStep {
  std::string what;  // "reading wreck.ply"; empty before the first step and during short steps
  double part = 0;   // fraction of the step that is done, 0 to 1; 0 = unknown
};

/// Sets the step. Any thread may call it. `triangles` is the approximate size of the step. For fewer than 300,000 triangles the
/// step is short and `what` stays empty.
void begin_load_step(std::string what, std::uint64_t triangles);
void load_step_reached(double part);
LoadStep load_step();

}  // namespace sonar
