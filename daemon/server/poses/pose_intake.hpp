// Receives poses, and requests to place objects and to control trajectories, from PoseServer and the control servers. It
// converts wall time to the daemon's time, passes poses to the World, which accepts or refuses them, and logs refusals.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "daemon/emulator/world/plausibility.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/api/events.hpp"
#include "daemon/server/system/log.hpp"
#include "daemon/server/time/clock.hpp"

namespace sonar {

// Counts of the distances that a MAVLink link sends, for status and metrics.

/// Messages since the start. Distances that the vehicle did not request are not counted.
struct LinkFigures {
  std::string endpoint;  // such as "udpin:127.0.0.1:14551"
  std::string vehicle;
  std::uint64_t sent = 0;
  std::uint64_t withheld = 0;     // messages that a fault withheld
  std::uint64_t unaddressed = 0;  // messages for which the link had not detected a vehicle
  std::uint64_t refused = 0;      // messages that the socket refused: a full buffer, or no route to the other end

  std::uint64_t dropped() const { return withheld + unaddressed + refused; }
};

class PoseIntake {
 public:
  PoseIntake(World& world, const Clock& clock, Log& log, std::function<void()> on_pose, Events* events = nullptr,
             Plausibility* plausibility = nullptr)
      : world_(world), clock_(clock), log_(log), on_pose_(std::move(on_pose)), events_(events), plausibility_(plausibility) {}

  /// Accepts or refuses a pose. Returns one sentence if it is refused, else an empty text.
  std::string take(control::PoseSample sample, const Sender& sender);
  /// Places, shows or hides the moving object `body` of the world. Returns a refusal, as take() does.
  std::string place(const control::SetObject& asked, std::size_t body, const Sender& sender);
  /// Pauses, seeks or plays a trajectory. Returns a refusal, as take() does.
  std::string steer(const control::SetTrajectory& asked, const Sender& sender);
  /// Returns the source of a vehicle's poses while they arrive, else empty.
  std::string_view live_source(const std::string& vehicle) const;
  /// Counts and logs an invalid pose message.
  void refuse(const std::string& why, const Sender& sender);

 private:
  void map_wall(control::Stamp& stamp);
  void log_refusal(const std::string& why, const Sender& sender);

  World& world_;
  const Clock& clock_;
  Log& log_;
  std::function<void()> on_pose_;
  Events* events_;
  Plausibility* plausibility_;
  LogLimiter refusals_, notices_;
  struct Newest {
    std::string source;
    Time at{};
  };
  std::map<std::string, Newest> newest_;    // the last accepted poses; key: the vehicle that the pose names, or empty
  std::uint32_t placements_ = 0;            // placements of moving objects; each begins a new history
  std::chrono::nanoseconds wall_shift_{0};  // our time = WALL stamp + shift
};

}  // namespace sonar
