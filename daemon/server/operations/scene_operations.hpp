// Carries out requests that load another scene, or add, remove, move or hide objects.
#pragma once

#include <functional>
#include <string>

#include "daemon/config/config.hpp"
#include "daemon/server/api/events.hpp"
#include "daemon/server/api/operations.hpp"
#include "daemon/server/engine/scene_changes.hpp"
#include "daemon/server/poses/pose_intake.hpp"

namespace sonar {

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

}  // namespace sonar
