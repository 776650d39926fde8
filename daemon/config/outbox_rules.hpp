// What a configuration says of the pings that wait for a client (daemon/sonars/outbox.hpp).
#pragma once

namespace sonar {

enum class WhenFull { replace_oldest, drop_newest };

struct OutboxRules {
  static constexpr int deepest = 3;
  int depth = 1;  // waiting pings beside the message being written, 1..deepest
  WhenFull when_full = WhenFull::replace_oldest;
};

}  // namespace sonar
