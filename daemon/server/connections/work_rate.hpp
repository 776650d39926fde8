// Limits the work that the clients of one address cause: a token bucket per address, so that repeated connecting gains nothing
// and a flood from one address delays no other. The unit of work is a byte: received bytes, bytes of answers, and fixed numbers
// for work that does not depend on bytes. Pure arithmetic, like InputRate.
#pragma once

#include <algorithm>
#include <map>
#include <string>

#include "daemon/server/connections/input_rate.hpp"

namespace sonar {

/// Work in bytes. Measured: a byte costs at most 50 ns of the I/O thread, so the default rate uses at most 5 % of its time.
namespace work {
inline constexpr std::size_t of_connection = 1024, of_request = 512, of_upgrade = 32768;  // HTTP
inline constexpr std::size_t of_frame = 64, of_control_frame = 512;                       // WebSocket
inline constexpr std::size_t of_message = 128;                                            // control stream, with an answer
inline constexpr std::size_t of_datagram = 256;                                           // datagram at a port of a sonar
inline constexpr std::size_t of_reaction = 256;  // reply of a sonar, or request that it carries out
}  // namespace work

class WorkRate {
 public:
  using Steady = InputRate::Steady;
  static constexpr std::size_t most_addresses = 256;
  /// Upper limit of any pause, so that /healthz answers within it.
  static constexpr std::chrono::seconds longest_pause{1};

  /// Counts work of the address. Returns the time that it must wait; may be 0. `per_s`: the present limit.
  Steady::duration pause_after(const std::string& address, std::size_t amount, std::size_t per_s, Steady::time_point now) {
    if (!addresses_.contains(address) && addresses_.size() >= most_addresses) forget_one();
    auto& [rate, used_at] = addresses_.try_emplace(address, InputRate(per_s), now).first->second;
    used_at = now;
    rate.use(per_s);
    const auto pause = rate.pause_after(amount, now);
    rate.forgive_beyond(longest_pause);
    return std::min(pause, Steady::duration(longest_pause));
  }
  /// Counts the work like pause_after(). False: the address is over its limit, so drop the input.
  bool takes(const std::string& address, std::size_t amount, std::size_t per_s, Steady::time_point now) {
    return pause_after(address, amount, per_s, now).count() == 0;
  }

 private:
  void forget_one() {
    addresses_.erase(std::min_element(addresses_.begin(), addresses_.end(),
                                      [](const auto& a, const auto& b) { return a.second.second < b.second.second; }));
  }
  std::map<std::string, std::pair<InputRate, Steady::time_point>> addresses_;
};

}  // namespace sonar
