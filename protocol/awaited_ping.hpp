// The ping for which a dialogue waits, in protocols whose hosts request each scan line.
#pragma once

#include <chrono>
#include <memory>
#include <utility>

#include "core/sonar/ping.hpp"

namespace sonar::protocol {

class AwaitedPing {
 public:
  bool is_under_way() const { return fired_ != nullptr; }
  Time fired_at() const { return fired_at_; }
  /// Returns the time after which the ping counts as lost. A ping that arrives later is still sent.
  Time lost_at() const { return fired_at_ + longest_wait; }

  /// Begins to wait for a ping. `with`: RequestPing::with, with which arrive() identifies the ping.
  void begin(std::shared_ptr<const VendorSettings> with, Time now) {
    fired_ = std::move(with);
    fired_at_ = now;
  }
  /// Called at lost_at(). Returns false if the computation of the ping has not begun (`ping_pending`); then the wait starts
  /// again.
  bool lose(bool ping_pending, Time now) {
    if (ping_pending) return fired_at_ = now, false;
    late_ = std::exchange(fired_, nullptr);
    return true;
  }
  /// Kind of a ping that has arrived: `other` belongs to a request that a newer request has replaced; `late` was counted as lost
  /// before.
  enum class Arrival { other, late, awaited };
  Arrival arrive(const VendorSettings* made_with) {
    if (late_ && made_with == late_.get()) return late_.reset(), Arrival::late;
    if (fired_ && made_with == fired_.get()) return fired_.reset(), Arrival::awaited;
    return Arrival::other;
  }
  /// Stops waiting. If the ping still arrives, arrive() returns `other`.
  void forget() {
    fired_.reset();
    late_.reset();
  }

 private:
  static constexpr auto longest_wait = std::chrono::seconds(2);

  std::shared_ptr<const VendorSettings> fired_, late_;
  Time fired_at_{};
};

}  // namespace sonar::protocol
