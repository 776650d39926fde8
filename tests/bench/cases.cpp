#include "tests/bench/cases.hpp"

#include <array>
#include <cmath>

#include "protocol/blueview/models.hpp"

namespace sonar::bench {
namespace {

constexpr int hf = 1, lf = 0;  // modes of the M1200d

BenchCase oculus(std::string name, std::string description, int mode, double range_m, int rows, bool near_bottom) {
  BenchCase c{std::move(name), std::move(description), {}, {}, near_bottom};
  if (auto profile = protocol::find_profile("oculus-m1200d")) c.profile = *profile;
  PingSettings& s = c.settings;
  s.mode = mode;
  s.beam_count = 512;
  s.range_m = range_m;
  s.range_bin_count = rows;
  s.range_bin_m = range_m / rows;
  s.pulse_width_m = static_cast<float>(0.9 * s.range_bin_m);
  s.gain_db = 48;
  s.device_sound_speed_mps = 1500;
  s.format.gamma = 127.0f / 255.0f;
  return c;
}

/// Returns settings of the P900-90 at 10 m; the pulse is as long as a row.
PingSettings p900_90_preset() {
  constexpr double inch_m = 0.0254;
  constexpr int rows = 394;
  PingSettings settings;
  settings.beam_count = 512;
  settings.range_bin_count = rows;
  settings.range_bin_m = inch_m;
  settings.range_m = rows * inch_m;
  settings.pulse_width_m = static_cast<float>(inch_m);
  settings.rate_hz = 15;
  settings.gain_db = 48;
  settings.format.bits = 16;
  settings.format.max_code = 65535;
  return settings;
}

BenchCase p900() {
  BenchCase c{"P1", "P900-90, 10 m, 394 rows", {}, p900_90_preset(), false};
  c.profile.model = blueview::models().front();
  return c;
}

}  // namespace

std::vector<BenchCase> bench_cases() {
  BenchCase paper = p900();
  paper.name = "P2", paper.description = "P1 in paper mode, 300 rays";
  paper.mode = Mode::paper;
  BenchCase fine = oculus("P4a", "M1200d HF, 10 m, 4,000 rows, 300 rays", hf, 10, 4000, false);
  BenchCase far = oculus("P4b", "M1200d LF, 30 m, 12,000 rows, 300 rays", lf, 30, 12000, false);
  fine.fixed_fan = far.fixed_fan = 300;
  return {p900(),
          paper,
          oculus("P3a", "M1200d HF, 10 m, 437 rows", hf, 10, 437, false),
          oculus("P3b", "M1200d HF, 10 m, 720 rows forced", hf, 10, 720, false),
          oculus("P3c", "M1200d HF, 2 m, 703 rows", hf, 2, 703, true),
          oculus("P3d", "M1200d LF, 30 m, 720 rows forced", lf, 30, 720, false),
          fine,
          far};
}

std::optional<BenchCase> find_case(std::string_view name) {
  for (BenchCase& c : bench_cases())
    if (c.name == name) return std::move(c);
  return {};
}

std::span<const BenchScene> bench_scenes() {
  static const std::array<BenchScene, 2> scenes{{{"local-search", -10, {0, 0, 0}}, {"demo", -5, {-6.5, 0.5, 0}}}};
  return scenes;
}

Pose bench_pose_at(const BenchCase& c, const BenchScene& scene, double x_m, double y_m, double yaw_rad) {
  const double height = c.near_bottom ? 0.9 : 2.0, pitch = c.near_bottom ? 0.6 : 0.25;  // nose down, towards the bed
  return {{x_m, y_m, scene.bed_z_m + height}, quat_from_rpy({0, pitch, yaw_rad})};
}

Pose bench_pose(const BenchCase& c, const BenchScene& scene, double time_s) {
  // Forward at under 1 m/s while the bow swings by up to 20 degrees a second.
  return bench_pose_at(c, scene, scene.start_m.x + 0.9 * time_s, scene.start_m.y, 0.35 * std::sin(time_s));
}

}  // namespace sonar::bench
