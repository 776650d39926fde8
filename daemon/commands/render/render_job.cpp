#include "daemon/commands/render/render_job.hpp"

#include <algorithm>
#include <utility>

#include "core/sonar/range_image.hpp"
#include "core/text/format.hpp"
#include "daemon/emulator/sonar/ping_request.hpp"
#include "daemon/emulator/world/world_parts.hpp"

namespace sonar::render {

double first_depth_m(const RenderJob& job) {
  // A world without objects is enough to place the sonar.
  const World vehicles(pose_rules(job.config), vehicles_of(job.config), {}, job.begins_at);
  return depth_from_z(compose(vehicles.vehicle_at(job.sonar().vehicle, Time{}), job.sonar().mount).position_m.z);
}

PingSettings device_settings(const RenderJob& job) {
  protocol::DeviceState device = device_state(job.sonar(), job.config, Time{});
  device.depth_m = first_depth_m(job);
  return job.sonar().profile.vendor->initial_settings(device).settings;
}

namespace {

/// Returns the settings that the device has in the mode of the job; without vendor settings if the sonar has no profile.
protocol::ChangeSettings as_the_device_keeps(const RenderJob& job) {
  const protocol::Vendor* const vendor = job.sonar().profile.vendor;
  if (vendor == nullptr) return {};
  protocol::DeviceState device = device_state(job.sonar(), job.config, Time{});
  device.depth_m = first_depth_m(job);
  protocol::ChangeSettings first = vendor->initial_settings(device);
  device.settings = first.vendor_settings;
  protocol::SettingsOverride wanted;
  wanted.mode = static_cast<std::uint32_t>(job.settings.mode);
  auto change = vendor->apply_override(wanted, device);
  return change ? *std::move(change) : std::move(first);
}

}  // namespace

std::optional<float> range_cell_m(const RenderJob& job) {
  const protocol::ChangeSettings kept = as_the_device_keeps(job);
  if (dynamic_cast<const RangeImageSettings*>(kept.vendor_settings.get()) == nullptr) return {};
  return kept.settings.pulse_width_m;
}

float pulse_of_mode_m(const RenderJob& job) {
  const PingSettings kept = as_the_device_keeps(job).settings;
  return static_cast<float>(static_cast<double>(kept.pulse_width_m) * job.settings.range_bin_m / kept.range_bin_m);
}

std::string note_of_range(const RenderJob& job) {
  constexpr double rounding = 1 + 1e-6;
  const double least_m = static_cast<double>(job.mode().min_range_m), most_m = static_cast<double>(job.mode().max_range_m);
  const double range_m = job.settings.range_m;
  if (range_m >= least_m / rounding && range_m <= most_m * rounding) return {};
  return text::format("range %g m: %s in mode %s accepts %g to %g m; rendered anyway, where the device would use %g m", range_m,
                      job.model().name.c_str(), job.mode().name.c_str(), least_m, most_m, std::clamp(range_m, least_m, most_m));
}

Result<void> follow(RenderJob& job, const motion::TrajectoryFile& file, const std::string& name, const std::string& body) {
  auto trajectory = motion::trajectory_of(file, name, body);
  if (!trajectory) return tl::make_unexpected(trajectory.error());
  job.snapshots = are_snapshots(**trajectory);
  job.begins_at = Time{} + file.begins_at;
  // The poses of the file replace the initial pose and the trajectory of the vehicle.
  job.vehicle() = {.name = job.vehicle().name,
                   .initial_pose = {},
                   .plan = {.trajectory = *std::move(trajectory), .file = name, .origin = file.origin}};
  return {};
}

std::vector<Time> pose_times(const RenderJob& job) {
  std::vector<Time> times;
  if (const motion::Plan& plan = job.vehicle().plan)
    for (const motion::Ns at : plan.trajectory->points().times) times.push_back(job.begins_at + at);
  return times;
}

World world_of(const RenderJob& job) {
  return World(pose_rules(job.config), vehicles_of(job.config), bodies_of(*job.scene, job.config), job.begins_at);
}

PingRequest make_request(const RenderJob& job, const World& world, PingNumber number, Time at) {
  const SonarConfig& sonar = job.sonar();
  PingRequest request = ping_request(job.config, world, sonar.vehicle, sonar.mount, at);
  // Snapshots are unrelated poses, so the sonar does not move during a ping.
  if (job.snapshots) request.sonar_moves = {};
  request.model = sonar.profile.model;
  request.number = number;
  request.settings = job.settings;
  request.vendor_settings = as_the_device_keeps(job).vendor_settings;  // these determine whether the ping is a range image
  request.bearings = sonar.bearings;
  request.sonar_id = static_cast<std::uint32_t>(job.sonar_index);
  return request;
}

namespace {

/// Removes poses that follow another in less than `shortest_step`. The last pose is kept if only one other is left.
motion::Trajectory thinned(const motion::Points& all) {
  motion::Points kept;
  for (std::size_t i = 0; i < all.times.size(); ++i) {
    const bool is_far = kept.times.empty() || all.times[i] - kept.times.back() >= shortest_step;
    if (!is_far && (i + 1 < all.times.size() || kept.times.size() > 1)) continue;
    kept.times.push_back(all.times[i]);
    kept.poses.push_back(all.poses[i]);
  }
  return motion::Trajectory(std::move(kept));
}

}  // namespace

Steps steps_of(const motion::Trajectory& trajectory) {
  Steps steps;
  if (!trajectory.points().velocities_mps.empty()) return steps;
  const motion::Trajectory thin_path = thinned(trajectory.points());
  const std::vector<motion::Ns>& times = thin_path.points().times;
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    const motion::Motion m = thin_path.at(times[i]).moves;  // the motion from this pose to the next
    const double mps = length(m.velocity_mps), radps = length(m.angular_velocity_radps);
    ++steps.all;
    if (!(mps <= fastest_vehicle_mps && radps <= fastest_vehicle_radps)) ++steps.too_fast;
    steps.fastest_mps = std::max(steps.fastest_mps, mps);
    steps.fastest_radps = std::max(steps.fastest_radps, radps);
  }
  return steps;
}

bool are_snapshots(const motion::Trajectory& trajectory) {
  const Steps steps = steps_of(trajectory);
  return steps.too_fast * steps_per_fast_step > steps.all;
}

std::string note_of_snapshots(const motion::Trajectory& trajectory) {
  const Steps steps = steps_of(trajectory);
  return text::format(
      "the poses are read as unconnected snapshots: %zu of %zu steps from one to the next are faster than a vehicle "
      "(%g m/s, %g rad/s; the fastest: %.3g m/s, %.3g rad/s). The sonar does not move during a ping; --motion on moves it",
      steps.too_fast, steps.all, fastest_vehicle_mps, fastest_vehicle_radps, steps.fastest_mps, steps.fastest_radps);
}

}  // namespace sonar::render
