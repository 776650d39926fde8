// The channel `/doctor` of the live view: the causes that keep drivers from getting pings (protocol/doctor/judge.hpp). The causes
// are checked and sent every two seconds while a viewer has subscribed. ViewFeed owns it, and only the I/O thread uses it.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <utility>

#include "daemon/emulator/view/ping_payloads.hpp"
#include "daemon/server/api/operations.hpp"
#include "daemon/server/time/clock.hpp"
#include "protocol/doctor/judge.hpp"

namespace sonar {

class ViewDoctor {
 public:
  static constexpr std::chrono::milliseconds period{2000};

  /// Both arguments must outlive the object.
  ViewDoctor(Operations& operations, const Clock& clock) : operations_(operations), clock_(clock) {}

  /// Returns the findings for a new subscriber, no older than the period; null if there is no status.
  ViewPayloadPointer newest();
  /// Returns new findings; null if all subscribers have the newest.
  ViewPayloadPointer news();

 private:
  using Steady = std::chrono::steady_clock;
  void look();
  /// Returns signs of a driver with a wrong address.
  doctor::Elsewhere look_elsewhere();

  Operations& operations_;
  const Clock& clock_;
  Steady::time_point looked_at_{};
  std::shared_ptr<const v1::DaemonStatus> last_;
  std::deque<std::pair<Steady::time_point, std::uint64_t>> failed_;  // failed connections of this computer at each check
  ViewPayloadPointer newest_, sent_;                                 // sent_: the payload that all subscribers have
};

}  // namespace sonar
