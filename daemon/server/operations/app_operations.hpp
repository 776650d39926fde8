// Carries out the requests of the control protocol (operations.hpp) by passing each to the responsible class. App owns it and
// these classes.
#pragma once

#include <functional>
#include <string>

#include "daemon/config/config.hpp"
#include "daemon/server/api/events.hpp"
#include "daemon/server/api/operations.hpp"
#include "daemon/server/engine/scene_changes.hpp"
#include "daemon/server/operations/fault_operations.hpp"
#include "daemon/server/operations/monitoring.hpp"
#include "daemon/server/poses/pose_intake.hpp"
#include "daemon/server/recording/recordings.hpp"
#include "daemon/server/sonars/fleet.hpp"
#include "daemon/server/time/stepped_time.hpp"

namespace sonar {

// Carries out requests that load another scene, or add, remove, move or hide objects.

class SceneOperations {
 public:
  /// `config` receives the file of a loaded scene.
  SceneOperations(Config& config, SceneChanges& changes, PoseIntake& poses, Events& events, Log& log, LoadScene load_scene)
      : config_(config), changes_(changes), poses_(poses), events_(events), log_(log), load_scene_(std::move(load_scene)) {}

  void load(const control::LoadScene& asked, const Sender& sender, Operations::Done done);
  void add(const control::AddObject& asked, const Sender& sender, Operations::Done done);
  void remove(const control::RemoveObject& asked, const Sender& sender, Operations::Done done);
  void set(const control::SetObject& asked, const Sender& sender, Operations::Done done);

 private:
  using Edit = std::function<Result<ScenePointer>(const Scene&)>;

  /// Edits the scene that results from the previous changes. `what` is the text for the log, such as "object crate added".
  void edit(Edit edit, const std::string& what, const Sender& sender, Operations::Done done);
  OperationResult without_details(const Error& error, const SceneFile& file, const Sender& sender);
  void log_change(const std::string& what, const Sender& sender);

  Config& config_;
  SceneChanges& changes_;
  PoseIntake& poses_;
  Events& events_;
  Log& log_;
  LoadScene load_scene_;
};

// Carries out requests for sonars: settings, water, and recordings.

class SonarOperations {
 public:
  /// Writes changed water to `config`.
  SonarOperations(Config& config, Fleet& fleet, Recordings& recordings, Log& log)
      : config_(config), fleet_(fleet), recordings_(recordings), log_(log) {}

  OperationResult set(const control::SetSonar& asked, const Sender& sender);
  OperationResult set(const control::SetEnvironment& asked, const Sender& sender);
  void start(const control::StartRecording& asked, const Sender& sender, Operations::Done done);
  void stop(const control::StopRecording& asked, Operations::Done done);

 private:
  /// Finds a sonar; an empty name means the only one.
  Result<Device*> find(const std::string& name);

  Config& config_;
  Fleet& fleet_;
  Recordings& recordings_;
  Log& log_;
};

// Carries out requests that move bodies or advance time: poses, steps of lockstep time, playback of trajectories.

class TimeOperations {
 public:
  /// `on_change` is called when time may advance.
  TimeOperations(SteppedTime& time, PoseIntake& poses, const Fleet& fleet, std::function<void()> on_change)
      : time_(time), poses_(poses), fleet_(fleet), on_change_(std::move(on_change)) {}

  void take(const control::PoseSample& sample, const Sender& sender, Operations::Done done);
  void step(const control::Step& asked, Operations::Done done, HasLeft has_left);
  OperationResult steer(const control::SetTrajectory& asked, const Sender& sender);

 private:
  std::uint64_t pings_made() const;

  SteppedTime& time_;
  PoseIntake& poses_;
  const Fleet& fleet_;
  std::function<void()> on_change_;
  std::uint64_t pings_reported_ = 0;  // number of pings in answers to steps so far
};

class AppOperations final : public Operations {
 public:
  AppOperations(SceneOperations& scene, SonarOperations& sonars, TimeOperations& time, const Monitoring& monitoring,
                FaultOperations& faults)
      : scene_(scene), sonars_(sonars), time_(time), monitoring_(monitoring), faults_(faults) {}

  void perform(const control::Operation& operation, const Sender& sender, Done done, HasLeft has_left = {}) override;
  std::string metrics() const override { return monitoring_.metrics(); }
  std::string problem() const override { return monitoring_.problem(); }

 private:
  SceneOperations& scene_;
  SonarOperations& sonars_;
  TimeOperations& time_;
  const Monitoring& monitoring_;
  FaultOperations& faults_;
};

}  // namespace sonar
