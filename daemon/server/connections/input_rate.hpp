// Limits the rate at which one client's bytes are read, and the work that the clients of one address cause, with token buckets
// and without I/O. After each read the Session waits for the returned pause, so that the excess bytes of a client wait in the
// client's kernel.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <limits>
#include <map>
#include <memory>
#include <string>

namespace sonar {

class InputRate {
 public:
  using Steady = std::chrono::steady_clock;
  /// After a pause, allows the bytes of one second at once. `bytes_per_s` 0 = no limit.
  explicit InputRate(std::size_t bytes_per_s) : rate_(static_cast<double>(bytes_per_s)), tokens_(rate_) {}
  /// Changes the rate from now on.
  void use(std::size_t bytes_per_s) { rate_ = static_cast<double>(bytes_per_s); }

  /// Reduces the excess, so that the next pause is at most `longest`.
  void forgive_beyond(Steady::duration longest) {
    tokens_ = std::max(tokens_, -rate_ * std::chrono::duration<double>(longest).count());
  }

  /// Returns the number of bytes that may be read now without a pause after them.
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

// Limits the rate at which the bytes of several clients are read, with one token bucket for all. A client within its fair share
// of the rate never waits; when the bucket is empty, only clients above their share wait.

class SharedRate {
 public:
  using Steady = InputRate::Steady;
  /// The share of one client, which counts while this object exists. It may outlive the SharedRate.
  class Part {
    friend class SharedRate;
    explicit Part(std::shared_ptr<const char> counted) : counted_(std::move(counted)) {}
    std::shared_ptr<const char> counted_;
    InputRate share_{at_once};
  };

  explicit SharedRate(std::size_t bytes_per_s) : bytes_per_s_(bytes_per_s), together_(bytes_per_s) {}
  /// Adds a client, and sets the rate.
  Part join(std::size_t bytes_per_s) {
    bytes_per_s_ = bytes_per_s;
    together_.use(bytes_per_s);
    return Part(counted_);
  }

  /// Returns the share of one client [bytes per second].
  std::size_t share() const {
    const auto parts = static_cast<std::size_t>(std::max(counted_.use_count() - 1, 1L));
    return std::max<std::size_t>(bytes_per_s_ / parts, 1);
  }
  /// Returns the number of bytes of the client that may be read now without a pause after them.
  std::size_t left(const Part& part, Steady::time_point now) const {
    return std::max(std::min(part.share_.left(now), share()), together_.left(now));
  }

  /// Counts bytes that were read from the client. Returns the pause before the next read; 0 = none.
  Steady::duration pause_after(Part& part, std::size_t bytes, Steady::time_point now) {
    part.share_.use(share());
    const auto of_all = together_.pause_after(bytes, now);
    return part.share_.pause_after(bytes, now).count() > 0 ? of_all : Steady::duration{};
  }

 private:
  static constexpr std::size_t at_once = 4096;  // first allowance of a client; a larger one would reward repeated connecting
  std::size_t bytes_per_s_;
  InputRate together_;
  std::shared_ptr<const char> counted_ = std::make_shared<const char>('\0');  // its use count is the number of Parts + 1
};

/// Work in bytes. A byte was measured to cost at most 50 ns of the I/O thread, so the default rate uses at most 5 % of its time.
namespace work {
inline constexpr std::size_t of_connection = 1024, of_request = 512, of_upgrade = 32768;  // HTTP
inline constexpr std::size_t of_frame = 64, of_control_frame = 512;                       // WebSocket
inline constexpr std::size_t of_message = 128;                                            // control stream, with an answer
inline constexpr std::size_t of_datagram = 256;                                           // datagram at a port of a sonar
inline constexpr std::size_t of_reaction = 256;  // reply of a sonar, or request that it carries out
}  // namespace work

/// Limits the work that the clients of one address cause: a token bucket per address, so that repeated connecting gains nothing
/// and a flood from one address delays no other. The unit of work is a byte: received bytes, bytes of answers, and fixed numbers
/// for work that does not depend on bytes.
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
