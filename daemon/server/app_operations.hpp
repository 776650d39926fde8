// Carries out what control asks (operations.hpp): reads and changes the parts of the App, which owns this and them.
#pragma once

#include <chrono>

#include "daemon/config/config.hpp"
#include "daemon/server/connections/admission.hpp"
#include "daemon/server/operations.hpp"
#include "daemon/server/poses/pose_intake.hpp"
#include "daemon/server/scene_changes.hpp"
#include "daemon/server/sonars/fleet.hpp"
#include "daemon/server/time/stepped_time.hpp"

namespace sonar {

class ControlServer;
class MavlinkServer;

struct AppParts {
  Config& config;
  Clock& clock;
  World& world;
  SteppedTime& time;
  Simulator& simulator;
  SceneChanges& changes;
  Admission& admission;
  PoseIntake& poses;
  Fleet& fleet;
  Events& events;
  Recordings& recordings;
  const ControlServer& control;  // asked where it listens, once all is made
  const MavlinkServer& mavlink;
  const Plausibility& plausibility;
  Log& log;
  std::function<void()> on_change;                                   // something stepped time may have waited for
  std::function<Result<ScenePointer>(const SceneFile&)> load_scene;  // empty: scenes cannot be loaded
};

class AppOperations final : public Operations {
 public:
  explicit AppOperations(AppParts parts) : parts_(std::move(parts)) {}

  void perform(const control::Operation& operation, const Sender& sender, Done done) override;
  std::string metrics() const override;
  std::string trouble() const override;
  /// A change of the scene takes longer than limits.load_s: a sentence; empty when none does.
  std::string slow_load() const;

 private:
  using Edit = std::function<Result<ScenePointer>(const Scene&)>;

  OperationResult carry_out(const control::SetSonar& asked, const Sender& sender);
  OperationResult carry_out(const control::SetEnvironment& asked, const Sender& sender);
  OperationResult carry_out(const control::SetTrajectory& asked, const Sender& sender);
  /// An empty name: the only one there is.
  Result<Device*> sonar_called(const std::string& name) const;
  void start(const control::StartRecording& asked, const Sender& sender, const Done& done);
  void take(const control::PoseSample& sample, const Sender& sender, Done done);
  void step(const control::Step& asked, Done done);
  std::uint64_t pings_made() const;
  void load(const control::LoadScene& asked, const Sender& sender, Done done);
  OperationResult without_words(const Error& error, const SceneFile& file, const Sender& sender);
  void set(const control::SetObject& asked, const Sender& sender, Done done);
  OperationResult set_moving(const control::SetObject& asked, std::size_t body, const Sender& sender);
  /// Of the scene as it is when the changes before have been made. `what` = for the log: "object crate added".
  void edit(Edit edit, const std::string& what, const Sender& sender, Done done);
  void say_change(const std::string& what, const Sender& sender);
  control::DaemonStatus status() const;

  AppParts parts_;
  std::uint64_t pings_told_ = 0;  // in answers to steps
  std::uint32_t placements_ = 0;  // of moving objects: none is a movement from the one before
  std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
};

}  // namespace sonar
