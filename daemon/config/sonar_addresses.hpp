// Addresses of the sonars of a configuration: moves them (`--offset N`), so that they do not conflict with those of a second
// daemon on the same computer, finds conflicts, and decides which receivers of pings clients may request.
#pragma once

#include "daemon/config/config.hpp"

namespace sonar {

inline constexpr int highest_offset = 99;
inline constexpr int ports_per_offset = 10;  // ports per offset; a daemon uses adjacent ports such as 14770 and 14771

/// Changes everything that could conflict with another daemon: sonars move from 127.0.0.x to 127.0.N.x (with the same ports,
/// which drivers expect), device ids increase by 100 N (drivers distinguish sonars by id), and the ports of poses and control
/// increase by 10 N. Ports that the system chooses (0) and dialled MAVLink endpoints do not change. `first_too`: also moves the
/// first sonar. Error: a moved address equals one of the unmoved configuration. Errors are sentences about the option.
Result<void> move_addresses(Config& config, int offset, bool first_too);

/// Returns an error (config) if two listeners of the configuration need the same port. Call it after applying the command line.
Result<void> check_ports_apart(const Config& config);

/// True for addresses that clients may request as receivers of a sonar's pings: addresses of single computers, and for broadcast
/// addresses and multicast groups that the product (`port`, of kind udp_stream) or the configuration (SonarConfig::groups) names.
bool may_receive(const Ipv4& ip, const protocol::Port& port, const SonarConfig& sonar);

}  // namespace sonar
