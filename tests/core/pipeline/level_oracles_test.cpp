// Oracles on levels of surfaces, in expected power: absolute, as a function of range and of sampling, and behind a box.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test::level_oracles_test {
namespace {

double db(double power_ratio) { return 10 * std::log10(power_ratio); }

std::shared_ptr<const Scene> flat_bed(double lambert_db) {
  return SceneMaker().add(height_field(-2, 40, -40, 40, 2, [](double, double) { return 0.0; }), lambert_db).make();
}

/// Returns the integral of E|s|^2 dt of a beam over rows [from, to).
double beam_energy(const Sounding& s, int beam, int from, int to) {
  double sum = 0;
  for (int row = from; row < to; ++row) sum += s.power(row, beam);
  return sum * 2 * s.request.settings.range_bin_m / 1500;
}

/// Returns the mean over the beams within `azimuth_deg` of straight ahead.
template <class Value>
double mean_over_beams(const Sounding& s, double azimuth_deg, Value&& value) {
  double sum = 0;
  int n = 0;
  for (int j = 0; j < s.beams(); ++j) {
    if (std::abs(std::asin(s.beam_sine(j))) > rad_from_deg(azimuth_deg)) continue;
    sum += value(j);
    ++n;
  }
  return sum / n;
}

TEST(LevelOracles, Oracle05_WallEnergyFallsAs20LogR) {
  const FrequencyMode mode = silent(p900());
  const double half_fan = 2.3 * rad_from_deg(10);  // beyond this angle the pattern adds less than 0.05 dB
  std::vector<double> level;
  for (const double d : {1.0, 2.0, 4.0, 8.0}) {
    Sounding s(SceneMaker().add(wall(30, 30), -20, {d, 0, 0}).make(), mode, native_rows(1.3 * d + 0.3, 0.0254));
    s.request.switches.expected_power = true;
    s.ping();
    const double energy = mean_over_beams(s, 3, [&](int j) { return beam_energy(s, j, 0, s.rows()); });
    level.push_back(db(energy));
    const double expected = reference::wall_energy(mode, s.medium(), s.envelope_hz(), lambert_coefficient(-20), d, half_fan);
    record_oracle(5, "absolute, by the integral over the wall", 0, db(energy / expected), 0.2, "dB");
  }
  for (std::size_t i = 1; i < level.size(); ++i) {
    record_oracle(5, "slope from 1 m", -20, (level[i] - level[0]) / (static_cast<double>(i) * std::log10(2.0)), 0.2, "dB/decade");
  }
}

struct BedCase {
  FrequencyMode mode;
  PingSettings settings;
  double tilt_rad;
};

// Blocks of rows and a few beams are averaged. In one sample the random positions of the cells would cause about half a dB,
// which is not a part of the level.
TEST(LevelOracles, Oracle08_AbsoluteSeabedLevel) {
  const double height = 2, lambert_db = -27;
  for (const BedCase& c : {BedCase{p900(), native_rows(10, 0.0254), 0.25}, BedCase{p900(), native_rows(10, 0.0254), 0.0},
                           BedCase{oculus_low(), native_rows(20, 0.0254), 0.2},
                           BedCase{oculus_high(), native_rows(10, 0.0125), 0.25}, BedCase{p900(), default_rows(10, 400), 0.25}}) {
    Sounding s(flat_bed(lambert_db), without_elevation_pattern(c.mode), c.settings);
    s.request.switches.expected_power = true;
    s.ping_from({0, 0, height}, {0, c.tilt_rad, 0});
    const double half_fan = 2.3 * static_cast<double>(c.mode.pattern.elevation_width_rad) / 2;
    const reference::SeabedLevel bed(s.mode(), s.medium(), s.envelope_hz(), lambert_db, height, c.tilt_rad);
    constexpr int block = 20;
    int blocks = 0;
    for (int row = 0; row + block <= s.rows(); row += block) {
      const double near_psi = bed.psi_rad(s.range_of_row(row) - 2 * 0.0254, 0.06);
      const double far_psi = bed.psi_rad(s.range_of_row(row + block) + 2 * 0.0254);
      if (!(near_psi > -half_fan && far_psi < half_fan)) continue;
      const double ratio = mean_over_beams(s, 3, [&](int j) {
        double sum = 0;
        for (int n = row; n < row + block; ++n) {
          sum += s.power(n, j) / power_from_db(bed.db(s.range_of_row(n), s.beam_sine(j)));
        }
        return sum / block;
      });
      record_oracle(8, "level over closed form, conical beams", 0, db(ratio), 0.3, "dB");
      ++blocks;
    }
    EXPECT_GT(blocks, 8) << c.mode.name;
  }
}

/// Returns the sum of sigma_i / r_i^4 from the beams of a whole ping. The sum of E|s|^2 over rows and beams counts every echo
/// theta_eff tau_eff times.
double echo_per_m2(const Sounding& s) {
  double sum = 0;
  for (int j = 0; j < s.beams(); ++j) sum += beam_energy(s, j, 0, s.rows());
  const Taper taper = s.mode().pattern.azimuth_taper;
  const double theta =
      effective_beam_width_u(taper, aperture_in_wavelengths(taper, static_cast<double>(s.mode().pattern.azimuth_width_rad)));
  const double du = s.beam_sine(0) - s.beam_sine(1);  // the spacing is uniform in the sine
  const double source = s.medium().source_upa;
  return sum * du / (theta * energy_width_s(s.envelope_hz()) * source * source);
}

TEST(LevelOracles, Oracle09_LambertSphere) {
  FrequencyMode mode = without_elevation_pattern(silent(p900()));
  mode.beam_spacing = BeamSpacing::uniform_in_sine;
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(40));
  const double a = 0.2, mu = lambert_coefficient(-15);
  for (const double d : {2.0, 3.0}) {
    PingSettings settings = native_rows(d + 0.5, 0.01);
    settings.beam_count = d > 2 ? 1024 : 512;
    for (const int fan : {1200, 0}) {  // 1200 rays over 46 degrees: 300 across the nearer sphere; then cells
      Sounding s(SceneMaker().add(sphere(a, 6), -15, {d, 0, 0}).make(), mode, settings);
      s.request.switches.expected_power = true;
      s.request.switches.fixed_fan = fan;
      s.ping();
      record_oracle(9, fan > 0 ? "echo of 300 rays across over the integral" : "echo of cells over the integral", 0,
                    db(echo_per_m2(s) / reference::sphere_echo_per_m2(mu, a, d)), 0.05, "dB");
    }
  }
}

/// Returns the mean power of a ping between two ranges, in beams within 30 degrees.
double mean_power(const Sounding& s, double from_m, double to_m) {
  const int from = static_cast<int>(s.row_of_range(from_m)), to = static_cast<int>(s.row_of_range(to_m));
  return mean_over_beams(s, 30, [&](int j) { return beam_energy(s, j, from, to); });
}

TEST(LevelOracles, Oracle21_EnergyDoesNotDependOnRays) {
  struct Case {
    std::shared_ptr<const Scene> scene;
    double height, tilt, from_m, to_m;
  };
  for (const Case& c :
       {Case{SceneMaker().add(wall(30, 30), -20, {5, 0, 0}).make(), 0, 0, 4, 8}, Case{flat_bed(-20), 2, 0.25, 3.6, 10}}) {
    std::vector<double> energy;
    for (const int fan : {0, 100, 300, 1000}) {
      Sounding s(c.scene, p900(), native_rows(10.5, 0.0254));
      s.request.switches.expected_power = true;
      s.request.switches.fixed_fan = fan;
      s.ping_from({0, 0, c.height}, {0, c.tilt, 0});
      energy.push_back(mean_power(s, c.from_m, c.to_m));
    }
    for (std::size_t i = 1; i < energy.size(); ++i)
      record_oracle(21, "100, 300, 1000 rays over cells", 0, db(energy[i] / energy[0]), 0.2, "dB");
  }
}

TEST(LevelOracles, Oracle22_EnergyDoesNotDependOnBeams) {
  for (const FrequencyMode& mode : {p900(), oculus_low()}) {
    std::vector<double> energy;
    for (const int beams : {256, 512, 1024}) {
      PingSettings settings = native_rows(10, 0.0254);
      settings.beam_count = beams;
      Sounding s(flat_bed(-20), mode, settings);
      s.request.switches.expected_power = true;
      s.ping_from({0, 0, 2}, {0, 0.25, 0});
      energy.push_back(mean_power(s, 3.5, 9.5));
    }
    record_oracle(22, "512 beams over 256", 0, db(energy[1] / energy[0]), 0.2, "dB");
    record_oracle(22, "1024 beams over 256", 0, db(energy[2] / energy[0]), 0.2, "dB");
  }
}

// The transmitter covers the sector evenly and one beam's skirt beyond it. Farther out there is no sound.
TEST(LevelOracles, EdgeBeamsAreNotDimAndNothingComesFromBeyond) {
  const double height = 2, lambert_db = -27, tilt = 0.25;
  for (const FrequencyMode& mode : {p900(), oculus_high()}) {
    Sounding s(flat_bed(lambert_db), without_elevation_pattern(mode), native_rows(8, 0.0254));
    s.request.switches.expected_power = true;
    s.ping_from({0, 0, height}, {0, tilt, 0});
    const reference::SeabedLevel bed(s.mode(), s.medium(), s.envelope_hz(), lambert_db, height, tilt);
    for (const int first : {0, s.beams() - 4}) {
      double ratio = 0;
      int n = 0;
      for (int row = static_cast<int>(s.row_of_range(6)); row < s.rows() - 4; ++row) {
        for (int j = first; j < first + 4; ++j, ++n)
          ratio += s.power(row, j) / power_from_db(bed.db(s.range_of_row(row), s.beam_sine(j)));
      }
      EXPECT_NEAR(db(ratio / n), 0, 0.3) << mode.name << " from beam " << first;
    }

    const double edge = std::sin(static_cast<double>(mode.horizontal_aperture_rad) / 2);
    const double width = 2 * std::sin(static_cast<double>(mode.pattern.azimuth_width_rad) / 2);
    const auto peak_of_point_at = [&](double sine) {
      Sounding p(SceneMaker().add_point(5.0 * Vec3d{std::sqrt(1 - sine * sine), sine, 0}, 0).make(), mode,
                 native_rows(6, 0.0254));
      p.ping();
      const int row = static_cast<int>(std::lround(p.row_of_range(5)));
      return p.pressure(row, p.loudest_beam(row));
    };
    const double inside = peak_of_point_at(edge - 4 * width);
    EXPECT_LT(peak_of_point_at(edge + 2.5 * width), 0.1 * inside);
    EXPECT_EQ(peak_of_point_at(edge + 3.6 * width), 0);
  }
}

// The shadow may contain the leakage of the rest of the bed through side lobes and pulse, plus 1 dB.
TEST(LevelOracles, Oracle33_ShadowBehindABox) {
  const double height = 2, lambert_db = -20;
  const Vec3d half{0.3, 0.6, 0.6}, place{4, 0.8, 0.6};  // to port; a mirrored shadow would be elsewhere
  SceneMaker maker;
  maker.add(height_field(-2, 40, -40, 40, 2, [](double, double) { return 0.0; }), lambert_db).add(box(half), -20, place);
  Sounding s(maker.make(), p900(), native_rows(10, 0.0254));
  s.request.switches.expected_power = true;
  s.ping_from({0, 0, height}, {0, 0.25, 0});

  // The bed as points of equal area, without the part that the box hides from the sonar (slab test).
  const auto hidden = [&](Vec3d p) {
    const Vec3d from{0, 0, height}, step = p - from;
    double enter = 0, leave = 1;
    const double o[3] = {from.x, from.y, from.z}, d[3] = {step.x, step.y, step.z}, c[3] = {place.x, place.y, place.z},
                 h[3] = {half.x, half.y, half.z};
    for (int i = 0; i < 3; ++i) {
      const double a = (c[i] - h[i] - o[i]) / d[i], b = (c[i] + h[i] - o[i]) / d[i];
      enter = std::max(enter, std::min(a, b)), leave = std::min(leave, std::max(a, b));
    }
    return enter < leave;
  };
  const double step = 0.011, mu = lambert_coefficient(lambert_db);
  const Quatd world_from_sonar = s.request.sonar_in_world.orientation;
  std::vector<reference::Scatterer> points;
  for (double x = 3; x < 8; x += step) {
    for (double y = -2.5; y < 4.5; y += step) {
      if (hidden({x, y, 0})) continue;
      const Vec3d in_sonar = rotate(conjugate(world_from_sonar), Vec3d{x, y, -height});
      const double sigma = lambert_per_area(mu, height / length(in_sonar)) * step * step;
      points.push_back(reference::scatterer_at(s.mode(), s.medium(), in_sonar, sigma, 1));
    }
  }
  // Rows completely behind the box and before the end of its shadow. The box's top edge casts the shadow up to x = 4.3 * 2 /
  // 0.8 m.
  const int from = static_cast<int>(s.row_of_range(5.3)), to = static_cast<int>(s.row_of_range(7.0));
  reference::Grid grid{1500, s.envelope_hz(), s.range_of_row(from), s.request.settings.range_bin_m, to - from};
  std::vector<int> beams;
  std::vector<double> sines;
  for (const double azimuth_deg : {9.0, 11.0, 13.0})
    beams.push_back(s.beam_at(rad_from_deg(azimuth_deg))), sines.push_back(s.beam_sine(beams.back()));
  const auto predicted = reference::expected_power(points, sines, s.mode().pattern, grid);
  for (std::size_t b = 0; b < beams.size(); ++b) {
    double got = 0, expected = 0, open = 0;
    for (int n = from; n < to; ++n) {
      got += s.power(n, beams[b]);
      expected += predicted[b][static_cast<std::size_t>(n - from)];
      open += s.power(n, s.beam_at(rad_from_deg(-11)));
    }
    record_below(33, "level in the shadow over the prediction", 1, db(got / expected), "dB");
    EXPECT_GT(db(got / expected), -3) << b;  // the leakage itself is present, so the prediction applies
    EXPECT_LT(db(got / open), -20) << b;
  }
}

TEST(LevelOracles, Oracle45_ModesDifferByAbsorptionAndBeamAlone) {
  FrequencyMode low = oculus_low(), high = oculus_high();
  const double d = 1.5;
  const auto level = [&](const FrequencyMode& mode, double& alpha_db) {
    Sounding s(SceneMaker().add(wall(20, 20), -20, {d, 0, 0}).make(), mode, native_rows(2.2, 0.0125));
    s.request.switches.expected_power = true;
    s.ping();
    alpha_db = 8.685889638 * s.medium().absorption_np_per_m;
    return db(mean_over_beams(s, 3, [&](int j) { return beam_energy(s, j, 0, s.rows()); }));
  };
  double alpha_low = 0, alpha_high = 0;
  const double difference = level(high, alpha_high) - level(low, alpha_low);
  const double solid_angle = db(0.4 * 12 / (0.6 * 20));
  EXPECT_GT(alpha_high, 2 * alpha_low);
  record_oracle(45, "high mode over low mode, a wall", solid_angle - 2 * (alpha_high - alpha_low) * d, difference, 0.3, "dB");
}

}  // namespace
}  // namespace sonar::test::level_oracles_test
