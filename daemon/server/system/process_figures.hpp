// Measures memory, descriptors, threads and processor time of this process, for /metrics and the status.
#pragma once

#include <cstdint>

namespace sonar {

struct ProcessFigures {
  std::uint64_t resident_bytes = 0, open_descriptors = 0, descriptor_limit = 0, threads = 0;
  double processor_s = 0;
};
/// Reads /proc; unreadable values are 0.
ProcessFigures figures_of_this_process();

}  // namespace sonar
