// Limits of the pings queued for a client (daemon/emulator/connections/outbox.hpp).
#pragma once

#include <array>
#include <string_view>

namespace sonar {

enum class WhenFull { replace_oldest, drop_newest };
inline constexpr std::array<std::string_view, 2> when_full_names = {"replace_oldest", "drop_newest"};

struct OutboxRules {
  static constexpr int deepest = 3;
  int depth = 1;  // waiting pings besides the current message, 1..deepest
  WhenFull when_full = WhenFull::replace_oldest;
  bool operator==(const OutboxRules&) const = default;
};

}  // namespace sonar
