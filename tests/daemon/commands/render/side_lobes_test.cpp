// Side lobes are on for products, and off for a sonar without a profile. Tests the echoes of a bed and of an obstacle outside the
// main lobe, for a product at its own settings.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/paper/paper_engine.hpp"
#include "core/sonar/water.hpp"
#include "daemon/commands/render/render_job.hpp"

namespace sonar::render::side_lobes_test {
namespace {

constexpr double depth_m = 10, tilt_deg = 15;

std::string at_depth(const std::string& objects, double pitch_deg) {
  return "scene: {objects: [" + objects + "]}\nposes: {at: {frame: ENU_FLU, xyz_m: [0, 0, " + std::to_string(-depth_m) +
         "], rpy_deg: [0, " + std::to_string(pitch_deg) + ", 0]}}\n";
}
const std::string point = at_depth("{type: point, target_strength_db: -10, pose: {xyz_m: [4, 0, -10]}}", 0);
const std::string m1200d = "sonar: {profile: oculus-m1200d}\n";

RenderJob job_of(const std::string& text) {
  auto input = parse_render_file(text, "r.yaml", ".");
  if (!input) throw std::runtime_error(input.error().text);
  return input->jobs.at(0);
}

Ping ping_of(const RenderJob& job, Parallel& pool) {
  PingRequest request = make_request(job, world_of(job), PingNumber{1}, Time{});
  request.switches.keep_pressure = true;
  return make_engine(job.scene, pool, {})->run({&request, 1}).at(0);
}

/// Returns sinc^4(x), x = L_v / lambda sin psi. It is 1/2 at half the width of the data sheet, where x = 0.3189.
double two_way(const FrequencyMode& mode, double psi_rad) {
  const double x = 0.31888 * std::sin(psi_rad) / std::sin(static_cast<double>(mode.pattern.elevation_width_rad) / 2);
  return x == 0 ? 1 : std::pow(std::sin(pi * x) / (pi * x), 4);
}

double db(double power_ratio) { return 10 * std::log10(power_ratio); }

/// Returns the mean power of beams within 10 degrees of the middle, in rows between two true ranges.
double mean_power(const RenderJob& job, const Ping& ping, double from_m, double to_m) {
  const PingSettings& s = job.settings;
  const double true_over_device = true_sound_speed_mps(job.config.water, depth_m) / static_cast<double>(s.device_sound_speed_mps);
  double sum = 0, n = 0;
  for (int row = 0; row < s.range_bin_count; ++row) {
    const double range_m = s.range_of_row(row) * true_over_device;
    if (range_m < from_m || range_m > to_m) continue;
    for (int j = 0; j < s.beam_count; ++j) {
      if (std::abs(ping.beam_azimuth_rad[static_cast<std::size_t>(j)]) > rad_from_deg(10.0)) continue;
      const auto p =
          static_cast<double>(ping.pressure_upa[static_cast<std::size_t>(row) * static_cast<std::size_t>(s.beam_count) +
                                                static_cast<std::size_t>(j)]);
      sum += p * p, ++n;
    }
  }
  return sum / n;
}

TEST(SideLobesOfProducts, AreOnByDefault) {
  const auto are_on = [](const std::string& rest) { return job_of(point + rest).config.engine.switches.side_lobes; };
  EXPECT_TRUE(are_on(m1200d));
  EXPECT_TRUE(are_on("engine: {noise: off}\n" + m1200d));
  EXPECT_FALSE(are_on("engine: {side_lobes: off}\n" + m1200d));
  EXPECT_FALSE(are_on(""));
  EXPECT_FALSE(are_on("sonar: {ping: {range_m: 6}}\n"));
  EXPECT_TRUE(are_on("engine: {side_lobes: on}\nsonar: {ping: {range_m: 6}}\n"));
}

TEST(SideLobesOfProducts, SwitchedOffAPingHasTheBytesOfTheCanonicalModel) {
  const std::string bed = at_depth("{type: plane, material: sand, size_m: [30, 30], pose: {xyz_m: [0, 0, -12]}}", tilt_deg);
  Parallel pool(2);
  const RenderJob off = job_of(bed + "engine: {side_lobes: off}\n" + m1200d), on = job_of(bed + m1200d);
  EXPECT_EQ(off.config.engine.switches, Switches{});
  RenderJob canonical = on;
  canonical.config.engine.switches = {};
  const Ping expected = ping_of(canonical, pool);
  EXPECT_EQ(ping_of(off, pool).samples, expected.samples);
  EXPECT_NE(ping_of(on, pool).samples, expected.samples);
}

// The fan of the main lobe ends where the two-way pattern is at -20 dB, so without side lobes the echo of the bed begins with a
// step. With side lobes the echo changes across that edge as the closed form does, about 3 dB in 15 cm. Without side lobes the
// signal before the edge is noise alone; it is subtracted. Speckle has a standard deviation of 0.2 dB (8 pings, some 800 looks
// on each side); the tolerance of 1 dB is five times as large.
TEST(SideLobesOfProducts, ABedBeginsWithoutAStep) {
  const std::string bed = at_depth("{type: plane, material: sand, size_m: [30, 30], pose: {xyz_m: [0, 0, -12]}}", tilt_deg);
  constexpr double nearest_m = 0.04, farthest_m = 0.11;  // from the edge, on either side: three rows
  Parallel pool(2);
  const RenderJob plain = job_of(bed + m1200d);
  const double height_m = 2,
               loss_db_per_m = absorption_db_per_m(plain.config.water, depth_m, static_cast<double>(plain.mode().centre_hz));
  const auto pattern_at = [&](double r) { return two_way(plain.mode(), std::asin(height_m / r) - rad_from_deg(tilt_deg)); };
  // Lambert's squared sine of grazing, spreading there and back, the area that a beam and a pulse cover, absorption.
  const auto level_at = [&](double r) {
    return pattern_at(r) * std::pow(height_m / r, 2) * std::pow(r, -3) / std::cos(std::asin(height_m / r)) *
           std::pow(10, -0.2 * loss_db_per_m * r);
  };
  double edge_m = 5;
  while (pattern_at(edge_m) > 0.01) edge_m -= 0.001;
  double level_before = 0, level_behind = 0;
  for (double off = nearest_m; off <= farthest_m; off += 0.005)
    level_before += level_at(edge_m - off), level_behind += level_at(edge_m + off);
  struct Powers {
    double before = 0, behind = 0;
  };
  const auto heard = [&](const std::string& engine) {
    RenderJob job = job_of(bed + engine + m1200d);
    Powers sum;
    for (job.config.seed = 1; job.config.seed <= 8; ++job.config.seed) {
      const Ping ping = ping_of(job, pool);
      sum.before += mean_power(job, ping, edge_m - farthest_m, edge_m - nearest_m);
      sum.behind += mean_power(job, ping, edge_m + nearest_m, edge_m + farthest_m);
    }
    return sum;
  };
  const Powers on = heard(""), off = heard("engine: {side_lobes: off}\n");
  const double noise = off.before, of_closed_form_db = db(level_behind / level_before);
  EXPECT_LT(of_closed_form_db, 5);
  EXPECT_NEAR(db((on.behind - noise) / (on.before - noise)), of_closed_form_db, 1);
  EXPECT_GT(db(off.behind / off.before), 10);
}

// Compares a sphere 2.7 m away, at the peak of the first side lobe (x = 1.43, 26.5 dB below the main lobe), with water alone.
TEST(SideLobesOfProducts, AnObstacleOutsideTheMainLobeIsThere) {
  Parallel pool(2);
  const double width = static_cast<double>(job_of(point + m1200d).mode().pattern.elevation_width_rad);
  const double psi = std::asin(1.43 / 0.31888 * std::sin(width / 2));
  const auto heard = [&](const std::string& engine, double ahead) {
    const std::string ball =
        at_depth("{type: sphere, material: rock, radius_m: 0.2, pose: {xyz_m: [" + std::to_string(ahead * 2.7 * std::cos(psi)) +
                     ", 0, " + std::to_string(-depth_m - 2.7 * std::sin(psi)) + "]}}",
                 0);
    const RenderJob job = job_of(ball + engine + m1200d);
    return mean_power(job, ping_of(job, pool), 2.5, 2.7);
  };
  const double water = heard("", -1);  // the sphere is behind the sonar
  EXPECT_GT(db(heard("", 1) / water), 10);
  EXPECT_NEAR(db(heard("engine: {side_lobes: off}\n", 1) / water), 0, 1);
}

}  // namespace
}  // namespace sonar::render::side_lobes_test
