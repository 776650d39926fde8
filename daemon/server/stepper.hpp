// Advances stepped time to the next ping or tick of a dialogue, as far as SteppedTime allows. App owns the Stepper and calls
// step() after every change, on the I/O thread.
#pragma once

#include <functional>
#include <optional>

#include "daemon/emulator/world/world.hpp"
#include "daemon/server/sonars/fleet.hpp"
#include "daemon/server/system/log.hpp"
#include "daemon/server/time/clock.hpp"
#include "daemon/server/time/stepped_time.hpp"

namespace sonar {

class Stepper {
 public:
  /// `on_change` is called when step() must be called again.
  Stepper(Clock& clock, World& world, SteppedTime& time, Fleet& fleet, Log& log, std::function<void()> on_change)
      : clock_(clock), world_(world), time_(time), fleet_(fleet), log_(log), on_change_(std::move(on_change)) {}

  /// Handles the next event if all earlier events are finished. Returns true if the daemon may end: `enough_served` returns true,
  /// and all requests are answered.
  bool step(const std::function<bool()>& enough_served);

 private:
  struct Due {
    Device* pings = nullptr;  // the device of the next ping
    std::optional<Time> ping, request, conversation;
  };
  Due next_due();
  bool is_overdue();
  void advance(Time to);
  void skip();

  Clock& clock_;
  World& world_;
  SteppedTime& time_;
  Fleet& fleet_;
  Log& log_;
  std::function<void()> on_change_;
};

}  // namespace sonar
