#include "daemon/commands/render/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/pulses/pulse.hpp"
#include "core/pipeline/scattering_law.hpp"
#include "core/scene/shapes/primitives.hpp"
#include "core/sonar/range_image.hpp"

namespace sonar::render {

ResolutionCell cell_of(const RenderJob& job) {
  const BeamPattern& pattern = job.mode().pattern;
  const double one_way_mps = 0.5 * static_cast<double>(job.settings.device_sound_speed_mps);
  const Pulse pulse(job.mode().waveform, static_cast<double>(job.settings.pulse_width_m) / one_way_mps);
  ResolutionCell cell;
  cell.energy_s = pulse.energy_width_s();
  cell.pulse_width_m = pulse.width_s() * one_way_mps;
  if (pattern.azimuth_taper != Taper::unit)
    cell.beam_u = effective_beam_width_u(
        pattern.azimuth_taper, aperture_in_wavelengths(pattern.azimuth_taper, static_cast<double>(pattern.azimuth_width_rad)));
  return cell;
}

namespace {

constexpr double least_pattern = 0.1;     // -20 dB
constexpr double level_tolerance = 1e-6;  // tolerance of the sine or cosine with which bed and sonar count as level

struct Bed {
  double height_m = 0;  // height of the sonar above the bed
  const Material* material = nullptr;
};

/// Returns the nearest level plane below the sonar.
std::optional<Bed> bed_below(const Scene& scene, Vec3d sonar_m) {
  std::optional<Bed> bed;
  for (const Object& o : scene.objects) {
    const Vec3d up = rotate(o.in_world.orientation, Vec3d{0, 0, 1});
    const double height_m = sonar_m.z - o.in_world.position_m.z;
    if (o.primitive.kind != Primitive::Kind::plane || std::abs(up.z) < 1 - level_tolerance || height_m <= 0) continue;
    if (!bed || height_m < bed->height_m) bed = Bed{height_m, &scene.materials[o.mesh->material.front()]};
  }
  return bed;
}

/// The echo of the bed: SL - 40 log r - 2 alpha r + S_b + 10 log10(theta_eff r (c / 2) tau_eff F) dB, plus the two-way pattern in
/// dB. power() returns it as a power, not in dB; there F is `oblique`.
class ClosedForm {
 public:
  ClosedForm(const RenderJob& job, const Ping& ping, const Bed& bed)
      : mode_(job.mode()), bed_(bed), tilt_rad_(rpy_from_quat(ping.request.sonar_in_world.orientation).pitch_rad) {
    const double depth_m = depth_from_z(ping.request.sonar_in_world.position_m.z);
    sound_speed_mps_ = true_sound_speed_mps(job.config.water, depth_m);
    true_over_device_ = sound_speed_mps_ / static_cast<double>(job.settings.device_sound_speed_mps);
    absorption_ = nepers_from_db(absorption_db_per_m(job.config.water, depth_m, static_cast<double>(mode_.centre_hz)));
    const ResolutionCell cell = cell_of(job);
    area_per_m2_ = cell.beam_u * 0.5 * sound_speed_mps_ * cell.energy_s;
    has_pattern_ = mode_.pattern.elevation_taper != Taper::unit;
    aperture_ = has_pattern_ ? elevation_aperture_in_wavelengths(mode_.pattern) : 0;
    unit_reach_rad_ =
        static_cast<double>(mode_.pattern.elevation_width_rad) * 1.1;  // less than the 1.15 widths of the fan of rays
  }

  double true_range_m(double device_range_m) const { return device_range_m * true_over_device_; }

  /// Returns the two-way pattern; 0 where the bed does not lie at that range, or is outside the beam.
  double pattern(double range_m, double sine) const {
    const double ahead2 = range_m * range_m * (1 - sine * sine) - bed_.height_m * bed_.height_m;
    if (!(ahead2 > 0)) return 0;
    const double psi = tilt_rad_ - std::atan2(bed_.height_m, std::sqrt(ahead2));
    if (!has_pattern_) return std::abs(psi) < unit_reach_rad_ ? 1 : 0;
    return std::abs(psi) < pi / 2 ? elevation_two_way(aperture_, psi) : 0;
  }
  /// Returns whether the bed fills the whole footprint of a bin: the bin, and pulse_m and beam_sine on either side of it.
  bool holds(double range_m, double sine, double pulse_m, double beam_sine) const {
    for (const double r : {range_m - pulse_m, range_m, range_m + pulse_m})
      for (const double u : {sine - beam_sine, sine, sine + beam_sine})
        if (!(pattern(r, u) > least_pattern)) return false;
    return true;
  }
  double power(double range_m, double sine) const {
    const double oblique = range_m / std::sqrt(range_m * range_m * (1 - sine * sine) - bed_.height_m * bed_.height_m);
    const double strength = scattering_strength(*bed_.material, bed_.height_m / range_m, static_cast<double>(mode_.centre_hz),
                                                sound_speed_mps_, false);
    const double amplitude = amplitude_from_db(static_cast<double>(mode_.source_level_db)) *
                             two_way_transmission(range_m, absorption_) * pattern(range_m, sine);
    return amplitude * amplitude * strength * area_per_m2_ * range_m * oblique;
  }

 private:
  const FrequencyMode& mode_;
  Bed bed_;
  double tilt_rad_, sound_speed_mps_ = 1500, true_over_device_ = 1, absorption_ = 0, area_per_m2_ = 0, aperture_ = 0;
  double unit_reach_rad_ = 0;
  bool has_pattern_ = true;
};

}  // namespace

RenderJob with_bed_only(RenderJob job) {
  Switches& switches = job.config.engine.switches;
  for (const NamedSwitch& part : named_switches)
    if (part.is_on != &Switches::conical) switches.*part.is_on = false;
  switches.expected_power = true;
  return job;
}

/// Compares the powers of each bin in whose whole footprint the closed form holds.
Result<Coverage> measure_coverage(const RenderJob& job, const Ping& ping) {
  const Pose& sonar = ping.request.sonar_in_world;
  const auto bed = bed_below(*job.scene, sonar.position_m);
  if (!bed)
    return failure(ErrorKind::bad_data,
                   "coverage needs a level `type: plane` below the sonar; scene " + job.scene->name + " has none");
  if (std::abs(rotate(sonar.orientation, Vec3d{0, 1, 0}).z) > level_tolerance)
    return failure(ErrorKind::bad_data, "coverage is defined for a sonar without roll; level it");
  if (!job.config.engine.switches.conical)
    return failure(ErrorKind::bad_data, "coverage is defined only for conical beams; remove the option --conical off");
  if (job.config.engine.switches.mode != Mode::canonical)
    return failure(ErrorKind::bad_data, "coverage is defined for the canonical model; leave out --mode paper or raster");
  if (job.mode().pattern.azimuth_taper == Taper::unit)
    return failure(ErrorKind::bad_data, "coverage is defined for beams with a width; beams with azimuth_taper: unit have none");
  const ClosedForm expected(job, ping, *bed);
  const PingSettings& s = job.settings;
  const double pulse_m = cell_of(job).pulse_width_m;
  const auto sine_of_width = [](float width_rad) { return 2 * std::sin(static_cast<double>(width_rad) / 2); };
  const std::vector<float>& widths = job.mode().beam_widths_rad;  // empty unless the profile lists its beams
  const double common_sine = sine_of_width(job.mode().pattern.azimuth_width_rad);
  Coverage coverage;
  double ratios = 0;
  for (int j = 0; j < s.beam_count; ++j) {
    // A bin counts if the bed fills its whole footprint; its ratio is the simulated power divided by that of the closed form.
    const auto beam = static_cast<std::size_t>(j);
    const double sine = std::sin(static_cast<double>(ping.beam_azimuth_rad[beam]));
    const double beam_sine = beam < widths.size() ? sine_of_width(widths[beam]) * std::sqrt(1 - sine * sine) : common_sine;
    for (int row = 0; row < s.range_bin_count; ++row) {
      const double r = expected.true_range_m(s.range_of_row(row));
      if (!expected.holds(r, sine, 2 * pulse_m, beam_sine)) continue;
      const auto at = static_cast<std::size_t>(row) * static_cast<std::size_t>(s.beam_count) + static_cast<std::size_t>(j);
      const double pressure = static_cast<double>(ping.pressure_upa[at]);
      const double ratio = pressure * pressure / (expected.power(r, sine) * beam_sine / common_sine);
      const double off_db = ratio > 0 ? db_from_power(ratio) : -999;
      ratios += ratio;
      ++coverage.bins;
      coverage.good += std::abs(off_db) <= 1;
      coverage.empty += off_db <= -10;
      if (std::abs(off_db) > std::abs(coverage.worst_db)) coverage.worst_db = off_db;
    }
  }
  if (coverage.bins == 0)
    return failure(ErrorKind::bad_data, "no bin of " + job.name + " lies on the bed; bring the sonar nearer, or tilt it");
  coverage.mean_db = db_from_power(ratios / static_cast<double>(coverage.bins));
  return coverage;
}

namespace {

constexpr double tilt_rad = 0.25, height_in_ranges = 0.2, bed_z_m = -20;

std::shared_ptr<const Scene> level_bed(double size_m) {
  auto scene = std::make_shared<Scene>();
  scene->name = "level bed";
  scene->materials.push_back({.name = "bed"});
  auto mesh = make_plane(size_m, size_m, std::max(1.0, size_m / 200));
  scene->objects.push_back({.name = "bed",
                            .mesh = std::make_shared<const Mesh>(std::move(mesh)),
                            .in_world = {{0, 0, bed_z_m}, {}},
                            .primitive = {.kind = Primitive::Kind::plane, .size_m = {size_m, size_m, 0}}});
  return scene;
}

bool acoustically_equal(const RenderJob& a, const RenderJob& b) {
  const FrequencyMode &m = a.mode(), &n = b.mode();
  return m.centre_hz == n.centre_hz && m.horizontal_aperture_rad == n.horizontal_aperture_rad &&
         m.pattern.azimuth_width_rad == n.pattern.azimuth_width_rad &&
         m.pattern.elevation_width_rad == n.pattern.elevation_width_rad && m.beam_spacing == n.beam_spacing &&
         a.settings.range_bin_count == b.settings.range_bin_count && a.settings.range_bin_m == b.settings.range_bin_m &&
         a.settings.beam_count == b.settings.beam_count;
}

}  // namespace

RenderJob over_a_level_bed(std::shared_ptr<const SonarModel> model, const PingSettings& settings, const std::string& name) {
  RenderJob job;
  job.settings = settings;
  job.name = name;
  job.sonar().name = model->profile;
  job.sonar().profile.model = std::move(model);
  job.vehicle().initial_pose = {{0, 0, bed_z_m + height_in_ranges * settings.range_m}, quat_from_rpy({0, tilt_rad, 0})};
  job.scene = level_bed(2.5 * settings.range_m);
  return job;
}

std::vector<RenderJob> shipped_sonars_over_a_bed() {
  std::vector<RenderJob> jobs;
  for (const protocol::Vendor* vendor : protocol::vendors())
    for (const auto& model : vendor->models())
      for (std::size_t mode = 0; mode < model->modes.size(); ++mode) {
        RenderJob job;
        SonarConfig& sonar = job.sonar();
        sonar.name = model->profile;
        sonar.profile = {vendor, model};
        sonar.options = protocol::check_options(*vendor, {}).value_or(protocol::OptionValues{});
        job.vehicle().initial_pose.position_m.z = bed_z_m;
        job.settings = device_settings(job);
        const double stored_m = job.settings.range_m;
        const bool has_another_pulse = job.settings.mode != static_cast<int>(mode) && !range_cell_m(job);
        job.settings.mode = static_cast<int>(mode);
        if (has_another_pulse) job.settings.pulse_width_m = pulse_of_mode_m(job);
        if (!job.mode().beam_azimuths_rad.empty())
          job.settings.beam_count = static_cast<int>(job.mode().beam_azimuths_rad.size());
        job.settings.range_m = std::min(stored_m, static_cast<double>(job.mode().max_range_m));
        job.settings.range_bin_m *= job.settings.range_m / stored_m;
        job.settings.pulse_width_m *= static_cast<float>(job.settings.range_m / stored_m);
        job.name = model->profile + " " + job.mode().name;
        job.vehicle().initial_pose = {{0, 0, bed_z_m + height_in_ranges * job.settings.range_m}, quat_from_rpy({0, tilt_rad, 0})};
        if (std::any_of(jobs.begin(), jobs.end(), [&](const RenderJob& other) { return acoustically_equal(job, other); }))
          continue;
        job.scene = level_bed(2.5 * job.settings.range_m);
        // Range images have no beams of a fan, so coverage is not defined for them.
        if (range_image_of(make_request(job, world_of(job), PingNumber{1}, Time{})) != nullptr) continue;
        jobs.push_back(std::move(job));
      }
  return jobs;
}

}  // namespace sonar::render
