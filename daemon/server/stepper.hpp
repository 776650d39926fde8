// Advances stepped time: to the next ping or event of a conversation that is due, as far as SteppedTime allows. Owned by App,
// which calls step() after every change; I/O thread only.
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
  /// `on_change` asks for another step().
  Stepper(Clock& clock, World& world, SteppedTime& time, Fleet& fleet, Log& log, std::function<void()> on_change)
      : clock_(clock), world_(world), time_(time), fleet_(fleet), log_(log), on_change_(std::move(on_change)) {}

  /// Does what is due next, once all that came before is done. With `enough_served` true, time does not pass any more; returns
  /// true when all requests that it allows to be answered have been, so that the daemon may end.
  bool step(const std::function<bool()>& enough_served);

 private:
  struct Due {
    Device* pings = nullptr;  // next
    std::optional<Time> ping, request, conversation;
  };
  Due next_due();
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
