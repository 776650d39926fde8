// Conditions that hold for every emulated sonar at any time.
#pragma once

#include <algorithm>

#include "daemon/emulator/sonar/sonar.hpp"
#include "tests/fuzz/byte_script.hpp"

namespace sonar::fuzz {

/// Checks for every connection that each offered ping is written, dropped, waiting, or being written.
inline void check_accounts(const Sonar& sonar) {
  for (const Connection& c : sonar.connections().all()) {
    const Outbox& box = c.outbox;
    const std::uint64_t gone = box.pings_written() + box.pings_dropped() + box.pings_waiting();
    require(gone <= box.pings_offered() && box.pings_offered() <= gone + 1);
    // A fault may have held pings back, which are then sent beyond the depth.
    require(box.pings_waiting() <= std::max(static_cast<std::size_t>(sonar.config().outbox.depth), Outbox::most_held));
  }
  const DeviceFigures f = sonar.figures();
  require(f.pings == f.unwanted + f.refused || f.pings > f.unwanted);
  require(f.clients_now <= static_cast<std::uint64_t>(sonar.config().max_clients));
}

}  // namespace sonar::fuzz
