// The input of `sonard render`: one sonar over one scene with its settings and trajectory, read from a configuration or from a
// render file (docs/render.md), which may sweep values and have expectations.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"
#include "core/sonar/ping.hpp"
#include "daemon/commands/render/expectation.hpp"
#include "daemon/commands/render/formula.hpp"
#include "daemon/commands/render/vehicle_path.hpp"
#include "daemon/config/config.hpp"

namespace sonar::render {

struct RenderJob {
  std::string name;
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const SonarModel> model;
  std::string sonar_name;
  std::uint32_t sonar_id = 0;  // keys the noise, as in the daemon
  PingSettings settings;
  Water water;
  std::uint64_t seed = 1;
  EngineConfig engine;
  Pose mount;                // sonar in vehicle
  std::string vehicle_name;  // of a configuration; empty in render files
  VehiclePath path;
  bool wants_motion = false;  // engine.motion: on is written in the file
  /// Of the scene's moving objects, in its order, on the same clock; null or not there: it rests.
  std::vector<std::shared_ptr<const motion::Trajectory>> body_paths;
  Values values;  // what the sweep set, and what `let` made of it
  std::vector<Expectation> expectations;

  const FrequencyMode& mode() const { return model->modes[static_cast<std::size_t>(settings.mode)]; }
};

struct RenderInput {
  std::string source;                   // the file
  std::vector<RenderJob> jobs;          // one, or one for every step of the sweep
  std::string text;                     // all that the file and the scene's file say, for the digest of the inputs
  std::vector<std::string> notes = {};  // decisions about the input that users should see; written to render.json
};

/// A configuration (it has `world:`) or a render file. `sonar`: which of a configuration's several sonars.
Result<RenderInput> load_render_input(const std::filesystem::path& file, const std::string& sonar = {});
/// A render file from text; paths in it are relative to `folder`.
Result<RenderInput> parse_render_file(std::string_view text, const std::string& name, const std::filesystem::path& folder);

/// A sentence when the product cannot be set to the range, which is rendered all the same; else empty.
std::string note_of_range(const RenderJob& job);

/// Everything a ping of the job depends on.
PingRequest make_request(const RenderJob& job, PingNumber number, Time at);

/// The settings a device of that profile starts with.
PingSettings device_settings(const protocol::Profile& profile, const protocol::OptionValues& options, const Water& water,
                             double depth_m);

}  // namespace sonar::render
