// Chooses the next ping if several sonars share one engine: the ping of the sonar with the least used computing time. Also
// decides whether a ping may start before the present one is finished. Callers pass the times.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>

namespace sonar {

class FairTurns {
 public:
  /// Call it when a sonar requests a ping. A sonar that was idle gets no advantage from its idle time.
  void ask(std::uint32_t sonar) {
    Account& a = accounts_[sonar];
    a.used_s = std::max(a.used_s, floor_s_);
  }
  /// Call it when a ping of the sonar begins.
  void begin(std::uint32_t sonar) { floor_s_ = std::max(floor_s_, accounts_[sonar].used_s); }
  /// Call it when a ping of the sonar is finished. `seconds`: time that the engine took.
  void end(std::uint32_t sonar, double seconds) {
    Account& a = accounts_[sonar];
    a.used_s += seconds;
    a.last_s = seconds;
    ++a.pings;
  }
  double used_s(std::uint32_t sonar) const {
    const auto it = accounts_.find(sonar);
    return it == accounts_.end() ? 0 : it->second.used_s;
  }
  bool several() const { return accounts_.size() > 1; }

  /// True if a ping of `other` should be computed before the rest of a ping of `running`, which has taken `elapsed_s` so far.
  /// The condition is that `other` has used less time, and that its ping takes less time than the rest.
  bool goes_first(std::uint32_t other, std::uint32_t running, double elapsed_s) const {
    const auto a = accounts_.find(other), b = accounts_.find(running);
    if (a == accounts_.end() || b == accounts_.end() || a->second.pings == 0 || b->second.pings == 0) return false;
    const bool had_less = a->second.used_s < b->second.used_s + elapsed_s;
    return had_less && a->second.last_s < b->second.last_s - elapsed_s;
  }

 private:
  struct Account {
    double used_s = 0, last_s = 0;
    std::uint64_t pings = 0;
  };
  std::map<std::uint32_t, Account> accounts_;
  double floor_s_ = 0;  // used_s that the sonar of the last begun ping had at the beginning of the ping
};

}  // namespace sonar
