// A fault as users write it: in the configuration, over HTTP, on the control stream, in sonarctl and in Python. The daemon
// checks it (daemon/config/faults/fault.hpp).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace sonar::control {

struct FaultRecord {
  std::string name;  // unique among the faults of the daemon; empty = made from `what`
  std::string what;  // code or name of a kind, or of a trouble: "L05", "silent-open", "power-cycle"
  std::map<std::string, std::string> with;
  std::string sonar;   // empty = all
  std::string client;  // "" or all, newest, oldest, an ordinal counted from 1, an address, a prefix 10.0.0.0/8
  struct At {          // at most one is set; none = at once
    std::optional<std::uint64_t> ping, every;
    std::uint64_t phase = 0;  // remainder, with `every`
    std::optional<double> time_s, probability;
    std::string on;  // an Occasion
    bool operator==(const At&) const = default;
  } at;
  struct For {  // each optional; see Span
    std::optional<double> seconds;
    std::optional<std::uint64_t> pings, count;
    bool operator==(const For&) const = default;
  } lasts;
  bool operator==(const FaultRecord&) const = default;
};

}  // namespace sonar::control
