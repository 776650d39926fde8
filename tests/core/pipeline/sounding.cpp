#include "tests/core/pipeline/sounding.hpp"

#include <cmath>
#include <span>
#include <string>
#include <utility>

#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"

namespace sonar::test {
namespace {

FrequencyMode mode_of(double hz, double aperture_deg, double azimuth_deg, double elevation_deg, double level_db,
                      BeamSpacing spacing) {
  FrequencyMode mode;
  mode.name = std::to_string(hz);
  mode.centre_hz = static_cast<float>(hz);
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(aperture_deg));
  mode.max_range_m = 100;
  mode.source_level_db = static_cast<float>(level_db);
  mode.beam_spacing = spacing;
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(azimuth_deg));
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(elevation_deg));
  mode.receiver.full_scale_upa = 1e9f;
  return mode;
}

}  // namespace

FrequencyMode p900() { return mode_of(900e3, 90, 1, 20, 210, BeamSpacing::uniform_in_angle); }
FrequencyMode oculus_low() { return mode_of(1.2e6, 130, 0.6, 20, 200, BeamSpacing::uniform_in_sine); }
FrequencyMode oculus_high() { return mode_of(2.1e6, 60, 0.4, 12, 200, BeamSpacing::uniform_in_sine); }

FrequencyMode silent(FrequencyMode mode) {
  mode.centre_hz = 1000;
  mode.name += " silent";
  return mode;
}
FrequencyMode without_elevation_pattern(FrequencyMode mode) {
  mode.pattern.elevation_taper = Taper::unit;
  mode.name += " flat";
  return mode;
}

PingSettings native_rows(double range_m, double pulse_width_m) {
  PingSettings s;
  const double spacing = 1500 / (2 * native_sample_rate_hz(envelope_parameter_hz(1500, pulse_width_m)));
  s.beam_count = 512;
  s.range_bin_m = spacing;
  s.range_bin_count = static_cast<int>(std::ceil(range_m / spacing));
  s.range_m = range_m;
  s.pulse_width_m = static_cast<float>(pulse_width_m);
  s.format = {.bits = 16, .max_code = 65535, .gamma = 1, .row_gains = false};
  return s;
}

PingSettings default_rows(double range_m, int rows) {
  PingSettings s = native_rows(range_m, 1);
  s.range_bin_count = rows;
  s.range_bin_m = range_m / rows;
  s.pulse_width_m = static_cast<float>(0.9 * range_m / rows);
  return s;
}

Sounding::Sounding(std::shared_ptr<const Scene> scene, const FrequencyMode& mode, const PingSettings& settings,
                   const SoundingOptions& options)
    : pool_(std::make_unique<Parallel>(options.threads)), engine_(make_cpu_engine(std::move(scene), *pool_, options.engine)) {
  auto model = std::make_shared<SonarModel>();
  model->profile = model->name = "test";
  model->modes = {mode};
  request.model = std::move(model);
  request.settings = settings;
  request.water = {.temperature_c = 10, .salinity_psu = 0, .ph = 8, .sound_speed_mps = 1500};
  request.switches.keep_pressure = true;
  request.switches.noise = false;
  request.switches.specular = false;  // tests of mirrors switch it on: at 1 kHz ("silent") every surface is a mirror
  request.seed = Seed{20250101};
}

const Ping& Sounding::ping() {
  ping_ = std::move(engine_->run(std::span(&request, 1)).front());
  return ping_;
}

const Ping& Sounding::ping_from(Vec3d position, RollPitchYaw attitude) {
  request.sonar_in_world = {position, quat_from_rpy(attitude)};
  return ping();
}

reference::Medium Sounding::medium() const {
  const double depth = depth_from_z(request.sonar_in_world.position_m.z);
  return {true_sound_speed_mps(request.water, depth),
          nepers_from_db(absorption_db_per_m(request.water, depth, static_cast<double>(mode().centre_hz))),
          amplitude_from_db(static_cast<double>(mode().source_level_db))};
}

double Sounding::envelope_hz() const {
  return envelope_parameter_hz(static_cast<double>(request.settings.device_sound_speed_mps),
                               static_cast<double>(request.settings.pulse_width_m));
}
double Sounding::range_of_row(double row) const { return request.settings.range_of_row(row); }
double Sounding::row_of_range(double range_m) const {
  return (range_m - request.settings.range_start_m) / request.settings.range_bin_m - request.settings.row_centre;
}

double Sounding::pressure(int row, int beam) const {
  return static_cast<double>(
      ping_.pressure_upa[static_cast<std::size_t>(row) * static_cast<std::size_t>(beams()) + static_cast<std::size_t>(beam)]);
}
double Sounding::beam_sine(int beam) const {
  return std::sin(static_cast<double>(ping_.beam_azimuth_rad[static_cast<std::size_t>(beam)]));
}

int Sounding::beam_at(double azimuth_rad) const {
  int best = 0;
  for (int j = 0; j < beams(); ++j) {
    const auto off = [&](int b) {
      return std::abs(static_cast<double>(ping_.beam_azimuth_rad[static_cast<std::size_t>(b)]) - azimuth_rad);
    };
    if (off(j) < off(best)) best = j;
  }
  return best;
}
int Sounding::loudest_row(int beam) const {
  int best = 0;
  for (int row = 0; row < rows(); ++row) {
    if (pressure(row, beam) > pressure(best, beam)) best = row;
  }
  return best;
}
int Sounding::loudest_beam(int row) const {
  int best = 0;
  for (int j = 0; j < beams(); ++j) {
    if (pressure(row, j) > pressure(row, best)) best = j;
  }
  return best;
}

Peak log_parabola(double before, double middle, double after) {
  const double a = std::log(before), b = std::log(middle), c = std::log(after);
  const double curve = a - 2 * b + c, slope = 0.5 * (c - a);
  return {-slope / curve, std::exp(b - 0.5 * slope * slope / curve)};
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double ma = 0, mb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) ma += a[i], mb += b[i];
  ma /= static_cast<double>(a.size()), mb /= static_cast<double>(b.size());
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - ma) * (b[i] - mb), aa += (a[i] - ma) * (a[i] - ma), bb += (b[i] - mb) * (b[i] - mb);
  }
  return ab / std::sqrt(aa * bb);
}

}  // namespace sonar::test
