// The input of `sonard render`: a scene and one sonar with its settings and trajectory, read from a configuration or from a
// render file. A render file may list several values of a key (a sweep, docs/render.md); each value then gives a job.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/motion/trajectory.hpp"
#include "core/motion/trajectory_file.hpp"
#include "core/scene/scene.hpp"
#include "core/sonar/ping.hpp"
#include "core/sonar/ping_settings.hpp"
#include "core/sonar/sonar_model.hpp"
#include "core/text/strict_yaml.hpp"
#include "daemon/commands/render/formula.hpp"
#include "daemon/config/config.hpp"
#include "daemon/emulator/world/world.hpp"

namespace sonar {
class ShapeCache;
}
namespace sonar::render {

// Reads the keys `model:` and `ping:` of a render file: the parameters of a product, and the settings that its client would send.
// Values without a key stay as they are.

void read_model(text::Map keys, FrequencyMode& mode);

/// How missing rows and pulse are derived from the range.
enum class RowsOf {
  no_device,    // row spacing follows the pulse: the sampling rate is 2 b (docs/acoustics.md, section 4)
  device,       // rows and pulse are proportional to the range
  range_image,  // rows are elevations and the pulse is the range cell of the product; neither depends on the range
};
/// Reads the keys of a sonar with this model.
void read_ping(text::Map keys, const SonarModel& model, RowsOf rows_of, PingSettings& settings);
/// Reads `mode:` of a ping, a name or a number from 1. The returned mode and `fallback` count from 0.
int read_mode(const text::Node& node, const SonarModel& model, int fallback);

struct RenderJob {
  /// Makes a job with one vehicle, which does not move, and on it one sonar, which has no profile.
  RenderJob() {
    config.vehicles.resize(1);
    config.sonars.resize(1);
  }

  std::string name;
  std::shared_ptr<const Scene> scene;
  Config config;                // for a render file: its one sonar and vehicle, water, seed and engine
  std::size_t sonar_index = 0;  // in config.sonars; the random noise depends on it, as in the daemon
  PingSettings settings;
  Time begins_at{};           // the time stamp at which trajectories begin
  std::string poses_note;     // a remark on the file of the poses; empty = none
  bool snapshots = false;     // true if the poses are unrelated; the sonar then does not move during a ping
  bool wants_motion = false;  // true if the file contains `engine: {motion: on}`
  Values values;              // values of the sweep and of `let`

  SonarConfig& sonar() { return config.sonars.at(sonar_index); }
  const SonarConfig& sonar() const { return config.sonars.at(sonar_index); }
  VehicleConfig& vehicle() { return config.vehicles.at(sonar().vehicle); }
  const VehicleConfig& vehicle() const { return config.vehicles.at(sonar().vehicle); }
  const SonarModel& model() const { return *sonar().profile.model; }
  const FrequencyMode& mode() const { return model().modes[static_cast<std::size_t>(settings.mode)]; }
};

struct RenderInput {
  std::string source;                   // name of the file
  std::vector<RenderJob> jobs;          // one job, or one for every step of the sweep
  std::string text;                     // text of the file and of the scene's file, for the digest of the inputs
  std::vector<std::string> notes = {};  // decisions about the input that users should see; written to render.json
};

/// Reads a configuration (recognised by its key `world`) or a render file. `sonar`: selects one of a configuration's sonars.
Result<RenderInput> load_render_input(const std::filesystem::path& file, const std::string& sonar = {});
/// Parses the text of a render file; paths in it are relative to `folder`.
Result<RenderInput> parse_render_file(std::string_view text, const std::string& name, const std::filesystem::path& folder);
/// Reads the jobs of a parsed render file. `known`: shapes of files that were read before.
Result<std::vector<RenderJob>> read_render_jobs(const text::Document& outline, const std::string& name,
                                                const std::filesystem::path& folder, ShapeCache* known = nullptr);
/// Returns the document with every $name and $(formula) replaced by its number.
Result<text::Document> with_numbers(const text::Document& outline, const Values& values, const std::string& name);

/// Returns a note for the user if the real sonar cannot be set to the range of the job (pings are rendered anyway); else empty.
std::string note_of_range(const RenderJob& job);
/// Returns the width of a range cell in the mode of the job, equal at every range; nullopt for a sonar without range images.
std::optional<float> range_cell_m(const RenderJob& job);
/// Returns the pulse width that the device has in the mode of the job, at the job's row spacing. Call it
/// only for a sonar that has a profile and sends no range images.
float pulse_of_mode_m(const RenderJob& job);

/// Makes the vehicle of the job follow the trajectory of `body` in the file, with the times of the file. An empty `body` means
/// the only body of the file. Errors begin with `name`, the name of the file.
Result<void> follow(RenderJob& job, const motion::TrajectoryFile& file, const std::string& name, const std::string& body);
/// Returns the times of the poses of the vehicle's trajectory; empty if it has none.
std::vector<Time> pose_times(const RenderJob& job);

/// Returns the vehicles and moving objects of the job, as the daemon creates them.
World world_of(const RenderJob& job);
/// Returns everything on which a ping of the job depends. `world` = world_of(job).
PingRequest make_request(const RenderJob& job, const World& world, PingNumber number, Time at);

/// Returns the depth of the sonar at time 0 [m]. The scene is not used, so it need not be loaded yet.
double first_depth_m(const RenderJob& job);
/// Returns the initial settings of the sonar at first_depth_m(). The sonar must have a profile.
PingSettings device_settings(const RenderJob& job);

// Detects files of unrelated poses, as in data sets. Such poses are too far apart for a trajectory, so they do not define the
// motion within a ping.

/// Highest speeds of a carrier of an imaging sonar: a fast boat, and a towfish that rolls. If more than one in
/// `steps_per_fast_step` steps is faster, the file contains snapshots, not a trajectory, unless it has velocities.
inline constexpr double fastest_vehicle_mps = 15, fastest_vehicle_radps = 5;
inline constexpr std::size_t steps_per_fast_step = 10;
/// Poses that are closer in time count as one step, because the jitter of a fast log is not motion.
inline constexpr motion::Ns shortest_step = std::chrono::milliseconds(100);

/// The number and speeds of the steps of a trajectory.
struct Steps {
  std::size_t all = 0, too_fast = 0;
  double fastest_mps = 0, fastest_radps = 0;
};
Steps steps_of(const motion::Trajectory& trajectory);
bool are_snapshots(const motion::Trajectory& trajectory);
/// Returns one sentence about a trajectory that is read as snapshots.
std::string note_of_snapshots(const motion::Trajectory& trajectory);

}  // namespace sonar::render
