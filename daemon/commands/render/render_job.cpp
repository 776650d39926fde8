#include "daemon/commands/render/render_job.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/geometry.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "core/pipeline/noise.hpp"
#include "core/sonar/range_image.hpp"
#include "core/text/decimal.hpp"
#include "core/text/format.hpp"
#include "daemon/config/scene_file.hpp"
#include "daemon/emulator/sonar/ping_request.hpp"
#include "daemon/emulator/world/world_parts.hpp"

namespace sonar::render {
namespace {

using text::Map;
using text::Node;
using text::Range;
constexpr int most_rows = 65535;

void set(const Node& node, Range range, float& value) {
  value = static_cast<float>(node.number_or(static_cast<double>(value), range));
}
void set_deg(const Node& node, Range range_deg, float& value_rad) {
  if (node.present()) value_rad = static_cast<float>(rad_from_deg(node.number(range_deg)));
}

void read_waveform(const Node& node, Waveform& waveform) {
  if (!node.present()) return;
  Map keys = node.map();
  using Shape = Waveform::Shape;
  waveform.shape = keys.required("shape").choice<Shape>(
      {{"gaussian", Shape::gaussian}, {"cw", Shape::cw}, {"lfm", Shape::lfm}, {"measured", Shape::measured}});
  set(keys.optional("sweep_s"), Range::between(1e-6, 1), waveform.sweep_s);
  waveform.falling = keys.optional("falling").boolean_or(waveform.falling);
  waveform.exact = keys.optional("exact").boolean_or(waveform.exact);
  if (waveform.shape != Shape::measured) return;
  waveform.sample_rate_hz = keys.required("sample_rate_hz").number(Range::between(1, 1e9));
  waveform.samples.clear();
  for (const Node& sample : keys.required("samples").items(3, 65536)) {
    const auto part = sample.numbers<2>();
    waveform.samples.emplace_back(static_cast<float>(part[0]), static_cast<float>(part[1]));
  }
}

void read_table(const Node& node, const Range& range, std::vector<float>& table) {
  if (!node.present()) return;
  table.clear();
  for (const Node& value : node.items(2, 512)) table.push_back(static_cast<float>(value.number(range)));
}

void read_profile(const Node& node, BeamProfile& profile) {
  if (!node.present()) return;
  Map keys = node.map();
  read_table(keys.optional("noise_db"), Range::between(-100, 100), profile.noise_db);
  const Node near = keys.optional("near_noise_db");
  read_table(near, Range::between(-100, 100), profile.near_noise_db);
  set(keys.optional("near_m"), Range::between(1e-3, 1000), profile.near_m);
  read_table(keys.optional("blend"), Range::between(-0.5, 1), profile.blend);
  if (near.present() && profile.noise_db.empty()) near.fail("needs noise_db");
}

void read_shared_noise(const Node& node, SharedNoise& noise) {
  if (!node.present()) return;
  Map keys = node.map();
  set(keys.optional("level_db"), Range::between(-200, 150), noise.level_db);
  noise.channels = static_cast<int>(keys.optional("channels").integer_or(noise.channels, 2, 4096));
  noise.group = static_cast<int>(keys.optional("group").integer_or(noise.group, 2, 4096));
  if (const std::string why = why_impossible(noise); !why.empty()) node.fail(why);
  set(keys.optional("sine"), Range::between(0.05, 0.99), noise.sine);
  set(keys.optional("full_m"), Range::between(1e-3, 1000), noise.full_m);
  set(keys.optional("steady"), Range::between(0, 1), noise.steady);
  set(keys.optional("focus_rows"), Range::between(-10, 10), noise.focus_rows);
  set(keys.optional("nearest_focus_m"), Range::between(0, 1000), noise.nearest_focus_m);
}

void read_receiver(const Node& node, ReceiverModel& law) {
  if (!node.present()) return;
  Map keys = node.map();
  const float infinity = std::numeric_limits<float>::infinity();
  set(keys.optional("tvg_slope_db"), Range::between(0, 100), law.tvg_slope_db);
  set(keys.optional("tvg_minimum_range_m"), Range::between(1e-3, 1000), law.tvg_minimum_range_m);
  const Node ceiling = keys.optional("tvg_ceiling_db");
  if (ceiling.present())
    law.tvg_ceiling_db = ceiling.is_scalar() && text::parse_infinity(ceiling.text())
                             ? infinity
                             : static_cast<float>(ceiling.number(Range::between(-200, 400)));
  set(keys.optional("full_scale_upa"), {.min = 0, .min_excluded = true}, law.full_scale_upa);
  set(keys.optional("noise_figure_db"), Range::between(-100, 200), law.noise_figure_db);
  set(keys.optional("crosstalk_db"), Range::between(-300, 0), law.crosstalk_db);
  set(keys.optional("noise_width"), Range::between(0.2, 5), law.noise_width);
  set(keys.optional("defocus"), Range::between(0, 1), law.defocus);
  read_profile(keys.optional("profile"), law.profile);
  read_table(keys.optional("channel_gain_db"), Range::between(-100, 100), law.channel_gain_db);
  read_shared_noise(keys.optional("shared_noise"), law.shared_noise);
  law.truncates = keys.optional("truncates").boolean_or(law.truncates);
  set(keys.optional("leak_upa"), Range::at_least(0), law.leak_upa);
  read_table(keys.optional("leak_ring_db"), Range::between(-300, 100), law.leak_ring_db);
  set(keys.optional("leak_ring_step_m"), Range::between(1e-5, 10), law.leak_ring_step_m);
  set(keys.optional("leak_decay_db_per_m"), Range::between(0, 1e4), law.leak_decay_db_per_m);
  law.leak_is_shared = keys.optional("leak_is_shared").boolean_or(law.leak_is_shared);
}

/// Reads lists of azimuths and widths, which replace the regular spacing.
void read_beams(const Node& azimuths, const Node& widths, FrequencyMode& mode) {
  if (azimuths.present()) {
    mode.beam_spacing = BeamSpacing::listed;
    mode.beam_azimuths_rad.clear();
    mode.beam_widths_rad.clear();
    for (const Node& azimuth : azimuths.items(1, 2048)) {
      const double rad = rad_from_deg(azimuth.number(Range::between(-85, 85)));
      if (!mode.beam_azimuths_rad.empty() && rad >= mode.beam_azimuths_rad.back()) azimuth.fail("must be below the one before");
      mode.beam_azimuths_rad.push_back(rad);
    }
  }
  if (!widths.present()) return;
  mode.beam_widths_rad.clear();
  for (const Node& width : widths.items(1, 2048))
    mode.beam_widths_rad.push_back(static_cast<float>(rad_from_deg(width.number(Range::between(0.01, 60)))));
  if (mode.beam_widths_rad.size() != mode.beam_azimuths_rad.size()) widths.fail("must be as many as beam_azimuths_deg");
}

}  // namespace

void read_model(Map keys, FrequencyMode& mode) {
  mode.name = keys.optional("name").text_or(mode.name, 64);
  set(keys.optional("centre_hz"), Range::between(100, 1e8), mode.centre_hz);
  set_deg(keys.optional("aperture_deg"), Range::between(0.1, 170), mode.horizontal_aperture_rad);
  set(keys.optional("source_level_db"), Range::between(0, 300), mode.source_level_db);
  mode.beam_spacing = keys.optional("beam_spacing")
                          .choice_or(mode.beam_spacing, {{"uniform_in_sine", BeamSpacing::uniform_in_sine},
                                                         {"uniform_in_angle", BeamSpacing::uniform_in_angle}});
  read_beams(keys.optional("beam_azimuths_deg"), keys.optional("beam_widths_deg"), mode);
  mode.interleaved_pings = static_cast<int>(keys.optional("interleaved_pings").integer_or(mode.interleaved_pings, 1, 64));
  set_deg(keys.optional("azimuth_width_deg"), Range::between(0.01, 60), mode.pattern.azimuth_width_rad);
  set_deg(keys.optional("elevation_width_deg"), Range::between(0.1, 120), mode.pattern.elevation_width_rad);
  mode.pattern.azimuth_taper = keys.optional("azimuth_taper")
                                   .choice_or(mode.pattern.azimuth_taper, {{"uniform", Taper::uniform},
                                                                           {"taylor30", Taper::taylor30},
                                                                           {"hamming", Taper::hamming},
                                                                           {"hann", Taper::hann},
                                                                           {"unit", Taper::unit}});
  mode.pattern.elevation_taper =
      keys.optional("elevation_taper")
          .choice_or(mode.pattern.elevation_taper, {{"uniform", Taper::uniform}, {"unit", Taper::unit}});
  mode.pattern.elevation_width_is = keys.optional("elevation_width_is")
                                        .choice_or(mode.pattern.elevation_width_is, {{"one_way", ElevationWidthIs::one_way},
                                                                                     {"two_way", ElevationWidthIs::two_way}});
  read_waveform(keys.optional("waveform"), mode.waveform);
  read_receiver(keys.optional("receiver"), mode.receiver);
}

int read_mode(const Node& node, const SonarModel& model, int fallback) {
  if (!node.present()) return fallback;
  if (text::parse_integer(node.text(64))) {
    const int modes = static_cast<int>(model.modes.size());
    return std::clamp(static_cast<int>(node.integer(1, modes)), 1, modes) - 1;  // integer() has reported a value outside
  }
  std::vector<std::string_view> names;
  for (const FrequencyMode& mode : model.modes) names.push_back(mode.name);
  return static_cast<int>(node.choice_index(std::move(names)));
}

/// Reads mode, range and rows in this order, because the default of each key depends on those before it.
void read_ping(Map keys, const SonarModel& model, RowsOf rows_of, PingSettings& s) {
  const PingSettings before = s;
  const bool own_grid = rows_of == RowsOf::no_device, range_image = rows_of == RowsOf::range_image;
  s.mode = read_mode(keys.optional("mode"), model, s.mode);
  const FrequencyMode& mode = model.modes[static_cast<std::size_t>(s.mode)];
  if (!own_grid) s.range_m = std::min(s.range_m, static_cast<double>(mode.max_range_m));
  s.range_m = keys.optional("range_m").number_or(s.range_m, Range::between(1e-3, 1e5));
  const Node start = keys.optional("range_start_m");
  s.range_start_m = start.number_or(s.range_start_m, Range::between(0, s.range_m));
  if (s.range_start_m >= s.range_m) start.fail("must be below range_m, where the picture ends");
  const double shown_m = s.range_m - s.range_start_m;
  const int listed = static_cast<int>(mode.beam_azimuths_rad.size());
  const bool is_listed = mode.beam_spacing == BeamSpacing::listed && listed > 0;
  s.beam_count = static_cast<int>(
      keys.optional("beams").integer_or(is_listed ? listed : s.beam_count, is_listed ? listed : 1, is_listed ? listed : 2048));
  s.device_sound_speed_mps = static_cast<float>(
      keys.optional("device_sound_speed_mps").number_or(static_cast<double>(s.device_sound_speed_mps), Range::between(100, 1e4)));
  set(keys.optional("device_absorption_db_per_m"), Range::between(0, 1000), s.device_absorption_db_per_m);

  // If the rows, their spacing or the pulse are not given, they follow from the others.
  const Node rows = keys.optional("rows"), spacing = keys.optional("row_spacing_m"), pulse = keys.optional("pulse_width_m");
  const Range a_length = Range::between(1e-5, 100);
  if (pulse.present()) s.pulse_width_m = static_cast<float>(pulse.number(a_length));
  const double c = static_cast<double>(s.device_sound_speed_mps);
  if (spacing.present())
    s.range_bin_m = spacing.number(a_length);
  else if (rows.present() || range_image)
    s.range_bin_m =
        shown_m / static_cast<double>(std::max<std::int64_t>(rows.integer_or(before.range_bin_count, 1, most_rows), 1));
  else if (own_grid)
    s.range_bin_m = c / (2 * native_sample_rate_hz(envelope_parameter_hz(c, static_cast<double>(s.pulse_width_m))));
  else
    s.range_bin_m = before.range_bin_m * s.range_m / before.range_m;
  if (!(s.range_bin_m > 0)) return;  // the error is reported already
  const double needed = std::max(std::ceil(shown_m / s.range_bin_m - 1e-9), 1.0);
  if (!rows.present() && needed > most_rows) {
    const Node& cause = spacing.present() || !pulse.present() ? spacing : pulse;
    cause.fail(text::format("the picture would have %.0f rows of %g m, and may have %d: make rows longer or the range shorter",
                            needed, s.range_bin_m, most_rows));
  }
  s.range_bin_count =
      static_cast<int>(rows.integer_or(static_cast<std::int64_t>(std::min<double>(needed, most_rows)), 1, most_rows));
  if (!pulse.present() && rows_of == RowsOf::device)
    s.pulse_width_m = static_cast<float>(static_cast<double>(before.pulse_width_m) * s.range_bin_m / before.range_bin_m);

  s.row_centre = keys.optional("row_centre").number_or(s.row_centre, Range::between(0, 1));
  s.samples_per_row = static_cast<int>(keys.optional("samples_per_row").integer_or(s.samples_per_row, 1, 64));
  set(keys.optional("rate_hz"), Range::between(0.001, 1000), s.rate_hz);
  s.ping_interval_s = keys.optional("ping_interval_s").number_or(s.ping_interval_s, Range::between(0, 10));
  set(keys.optional("gain_db"), Range::between(-200, 200), s.gain_db);
  s.tvg = keys.optional("tvg").boolean_or(s.tvg);
  const Node bits = keys.optional("bits");
  s.format.bits = bits.choice_or<int>(s.format.bits, {{"8", 8}, {"16", 16}, {"32", 32}});
  if (bits.present()) s.format.max_code = s.format.bits == 8 ? 254 : s.format.bits == 16 ? 65535 : 0xFFFFFFFFu;
  s.format.max_code = static_cast<std::uint32_t>(keys.optional("max_code").unsigned_integer_or(s.format.max_code, 0xFFFFFFFFu));
  set(keys.optional("gamma"), Range::between(0.01, 10), s.format.gamma);
  s.format.row_gains = keys.optional("row_gains").boolean_or(s.format.row_gains);
  using Scale = SampleFormat::Scale;
  s.format.scale =
      keys.optional("scale").choice_or<Scale>(s.format.scale, {{"linear", Scale::linear}, {"logarithmic", Scale::logarithmic}});
  set(keys.optional("floor_db"), Range::between(-300, 300), s.format.floor_db);
  set(keys.optional("ceiling_db"), Range::between(-300, 300), s.format.ceiling_db);
}

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
  if (file.replaced > 0)
    job.poses_note = name + ": " + text::counted(file.replaced, "pose") + " replaced by the next of the same stamp";
  // The poses of the file replace the initial pose and the trajectory of the vehicle.
  job.vehicle() = {.name = job.vehicle().name, .initial_pose = {}, .plan = plan_for(file, *std::move(trajectory), name)};
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
