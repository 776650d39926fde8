// Limits the rate at which one client's bytes are read: a token bucket. Pure arithmetic. After each read the Session waits for
// the returned pause, so that the excess bytes of a client wait in its own kernel.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <limits>

namespace sonar {

class InputRate {
 public:
  using Steady = std::chrono::steady_clock;
  /// Allows the bytes of one second at once after a pause. 0 bytes a second: no limit.
  explicit InputRate(std::size_t bytes_per_s) : rate_(static_cast<double>(bytes_per_s)), tokens_(rate_) {}
  /// Changes the rate from now on.
  void use(std::size_t bytes_per_s) { rate_ = static_cast<double>(bytes_per_s); }

  /// Reduces the excess, so that the next pause is at most `longest`.
  void forgive_beyond(Steady::duration longest) {
    tokens_ = std::max(tokens_, -rate_ * std::chrono::duration<double>(longest).count());
  }

  /// Bytes that may be read now without a pause after them.
  std::size_t left(Steady::time_point now) const {
    if (rate_ <= 0) return std::numeric_limits<std::size_t>::max();
    const double tokens =
        begun_ ? std::min(rate_, tokens_ + rate_ * std::chrono::duration<double>(now - last_).count()) : tokens_;
    return tokens > 0 ? static_cast<std::size_t>(tokens) : 0;
  }

  /// Counts bytes that were read. Returns the pause before the next read; 0 = none.
  Steady::duration pause_after(std::size_t bytes, Steady::time_point now) {
    if (rate_ <= 0) return {};
    if (begun_) tokens_ = std::min(rate_, tokens_ + rate_ * std::chrono::duration<double>(now - last_).count());
    begun_ = true;
    last_ = now;
    tokens_ -= static_cast<double>(bytes);
    if (tokens_ >= 0) return {};
    return std::chrono::duration_cast<Steady::duration>(std::chrono::duration<double>(-tokens_ / rate_));
  }

 private:
  double rate_, tokens_;
  bool begun_ = false;
  Steady::time_point last_{};
};

}  // namespace sonar
