// Moves the listeners of a configuration (`--offset N`), so that they do not conflict with each other or with a second daemon on
// the same computer.
#pragma once

#include "daemon/config/config.hpp"

namespace sonar {

inline constexpr int highest_offset = 99;
inline constexpr int ports_an_offset = 10;  // daemons listen on ports next to each other: 14770, 14771

/// Moves everything that could conflict with another daemon: sonars from 127.0.0.x to 127.0.N.x (drivers expect their ports),
/// device ids up by 100 N (drivers distinguish sonars by them), and the ports of poses and control up by 10 N. Ports that the
/// system chooses (0) and dialled MAVLink endpoints stay. `first_too`: also moves the first sonar's address. Refuses if a moved
/// address would be that of an unmoved part of the same configuration. Errors are sentences for the command line.
Result<void> move_addresses(Config& config, int offset, bool first_too);

/// Refused, as config, when two listeners of the configuration need the same port. Call after the command line has changed it.
Result<void> check_ports_apart(const Config& config);

}  // namespace sonar
