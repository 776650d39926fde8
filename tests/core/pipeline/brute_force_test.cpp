// Checks beyond the table of oracles: thin objects never vanish, relief and shadows agree with brute force, the world is far
// from its origin, and speckle at long range.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <tuple>
#include <vector>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test::brute_force_test {
namespace {

double db(double power_ratio) { return 10 * std::log10(power_ratio); }

/// Returns a round upright rod at the origin.
Mesh pole(double radius_m, double half_height_m, int sides) {
  Mesh mesh;
  for (int i = 0; i < sides; ++i) {
    const double a = 2 * pi * i / sides;
    mesh.vertices.push_back(to_float({radius_m * std::cos(a), radius_m * std::sin(a), -half_height_m}));
    mesh.vertices.push_back(to_float({radius_m * std::cos(a), radius_m * std::sin(a), half_height_m}));
  }
  const auto n = static_cast<std::uint32_t>(2 * sides);
  for (std::uint32_t i = 0; i < n; i += 2) {
    mesh.triangles.push_back({i, (i + 2) % n, (i + 3) % n});
    mesh.triangles.push_back({i, (i + 3) % n, i + 1});
  }
  return mesh;
}

// 2 cm at 8 m is a seventh of a P900's beam and less than the distance of two rays.
TEST(Truths, AThinPoleIsInEveryFrame) {
  const double radius = 0.01, half_height = 1;
  SceneMaker maker;
  maker.add_body(pole(radius, half_height, 24), -15, {{8, 0, 0}, {}});
  for (const auto& [mode, rows, name] : {std::tuple{p900(), 394, "P900"}, std::tuple{oculus_high(), 720, "M1200d HF"}}) {
    PingSettings settings = default_rows(10, rows);
    Sounding s(maker.make(), mode, settings);
    s.request.switches.expected_power = true;
    double weakest = 1e300, strongest = 0, farthest_off_deg = 0;
    for (int step = 0; step < 40; ++step) {
      const double y = 0.3 + 0.001 * step;
      s.request.bodies_in_world = {{{8, y, 0}, {}}};
      s.ping();
      const double range = std::hypot(8, y) - radius;
      double sum = 0;
      int loudest_beam = 0;
      double loudest = 0;
      for (int row = static_cast<int>(s.row_of_range(range - 0.1)); row < s.row_of_range(range + 0.3); ++row) {
        for (int j = 0; j < s.beams(); ++j) {
          const double power = s.power(row, j);
          sum += power;
          if (power > loudest) loudest = power, loudest_beam = j;
        }
      }
      weakest = std::min(weakest, sum), strongest = std::max(strongest, sum);
      const double off = std::asin(s.beam_sine(loudest_beam)) - std::atan2(y, 8);
      farthest_off_deg = std::max(farthest_off_deg, std::abs(deg_from_rad(off)));
    }
    record_below(no_number, std::string(name) + ", pole 2 cm thick at 8 m, 40 steps of 1 mm: strongest over weakest frame", 3,
                 db(strongest / weakest), "dB");
    record_below(no_number, std::string(name) + ", the same pole: loudest beam off its bearing", 0.3, farthest_off_deg, "deg");
  }
}

/// Heights on a grid with linear interpolation, as in the mesh. Look-ups are fast.
class Relief {
 public:
  Relief(double x0, double x1, double y0, double y1, double step_m, const std::function<double(double, double)>& z)
      : x0_(x0), y0_(y0), step_m_(step_m), nx_(static_cast<int>(std::lround((x1 - x0) / step_m)) + 1) {
    const int ny = static_cast<int>(std::lround((y1 - y0) / step_m)) + 1;
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx_; ++i) heights_.push_back(z(x0 + i * step_m, y0 + j * step_m));
    highest_m = *std::ranges::max_element(heights_);
  }
  double operator()(double x, double y) const {
    const double u = std::clamp((x - x0_) / step_m_, 0.0, nx_ - 1.001);
    const double v = std::clamp((y - y0_) / step_m_, 0.0, static_cast<double>(heights_.size()) / nx_ - 1.001);
    const auto i = static_cast<std::size_t>(u), j = static_cast<std::size_t>(v), row = static_cast<std::size_t>(nx_);
    const double a = u - static_cast<double>(i), b = v - static_cast<double>(j);
    const double* at = heights_.data() + j * row + i;
    return (1 - b) * ((1 - a) * at[0] + a * at[1]) + b * ((1 - a) * at[row] + a * at[row + 1]);
  }
  double highest_m = 0;

 private:
  double x0_, y0_, step_m_;
  int nx_;
  std::vector<double> heights_;
};

/// Brute force for a relief: every square of a fine grid is a scatterer with its own shadow ray, in double.
struct BruteForce {
  Vec3d sonar;
  double tilt_rad, lambert_db;
  const Relief& z;
  double step_m = 0.0125, march_m = 0.015;

  /// Returns whether the relief does not block the ray, by steps along the whole ray.
  bool sees(Vec3d p) const {
    const Vec3d to = sonar - p;
    const double far = length(to);
    const Vec3d along = (1 / far) * to;
    for (double t = march_m; t < far; t += march_m) {
      const Vec3d at = p + t * along;
      if (at.z > z.highest_m) return true;
      if (at.z < z(at.x, at.y) - 1e-5) return false;
    }
    return true;
  }
  std::vector<reference::Scatterer> scatterers(const Sounding& s, double x0, double x1, double y0, double y1) const {
    const Quatd world_from_sonar = s.request.sonar_in_world.orientation;
    const double mu = lambert_coefficient(lambert_db), h = 0.005;
    std::vector<reference::Scatterer> points;
    for (double x = x0 + step_m / 2; x < x1; x += step_m) {
      for (double y = y0 + step_m / 2; y < y1; y += step_m) {
        const Vec3d p{x, y, z(x, y)}, to = p - sonar;
        const Vec3d steep{-(z(x + h, y) - z(x - h, y)) / (2 * h), -(z(x, y + h) - z(x, y - h)) / (2 * h), 1};
        const double cosine = -dot(steep, to) / (length(steep) * length(to));
        if (cosine <= 0 || !sees(p)) continue;
        const double sigma = lambert_per_area(mu, cosine) * step_m * step_m * length(steep);
        points.push_back(reference::scatterer_at(s.mode(), s.medium(), rotate(conjugate(world_from_sonar), to), sigma, 1));
      }
    }
    return points;
  }
};

/// The difference of a ping from brute force, sample by sample. Samples in shadow, 20 dB below the smooth bed, contain only the
/// leakage of beams and pulses. For these the mean is compared. Samples at the edge of a shadow, 10 to 20 dB below, are not
/// compared.
struct Difference {
  double rms_db = 0, within_1_db = 0, shadow_re_bed = 0;  // the last: mean power divided by that of the smooth bed
  int lit = 0, shadowed = 0;
};
Difference compare(const Sounding& s, const BruteForce& relief, const std::vector<reference::Scatterer>& points, int every_beam,
                   double from_m, double to_m) {
  const int from = static_cast<int>(s.row_of_range(from_m)), to = static_cast<int>(s.row_of_range(to_m));
  const reference::Grid grid{1500, s.envelope_hz(), s.range_of_row(from), s.request.settings.range_bin_m, to - from};
  const reference::SeabedLevel bed(s.mode(), s.medium(), s.envelope_hz(), relief.lambert_db, relief.sonar.z, relief.tilt_rad);
  std::vector<int> beams;
  std::vector<double> sines;
  for (int j = 0; j < s.beams(); j += every_beam) beams.push_back(j), sines.push_back(s.beam_sine(j));
  const auto truth = reference::expected_power(points, sines, s.mode().pattern, grid);
  Difference d;
  for (std::size_t b = 0; b < beams.size(); ++b) {
    for (int n = 0; n < to - from; ++n) {
      const double smooth = power_from_db(bed.db(s.range_of_row(from + n), sines[b]));
      const double expected = truth[b][static_cast<std::size_t>(n)], got = s.power(from + n, beams[b]);
      if (expected < 0.01 * smooth) {
        d.shadow_re_bed += got / smooth;
        ++d.shadowed;
      } else if (expected > 0.1 * smooth) {
        const double off = db(got / expected);
        d.rms_db += off * off;
        d.within_1_db += std::abs(off) <= 1;
        ++d.lit;
      }
    }
  }
  d.rms_db = std::sqrt(d.rms_db / d.lit);
  d.within_1_db /= d.lit;
  d.shadow_re_bed /= std::max(d.shadowed, 1);
  return d;
}

FrequencyMode narrow_p900() {
  FrequencyMode mode = p900();
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(8));
  return mode;
}

// With wavelengths of 0.4 and 0.45 m, equal steps of the fan's refinement would hit only crests somewhere on the bed.
TEST(Truths, ARippledBottomAgreesWithBruteForce) {
  for (const double period_m : {0.5, 0.45, 0.4}) {
    const auto ripples = [period_m](double x, double) { return 0.01 * std::cos(2 * pi * x / period_m); };
    const Relief relief(2, 11, -2, 2, 0.02, ripples);
    const BruteForce truth{{0, 0, 2}, 0.25, -20, relief};
    PingSettings settings = native_rows(10, 0.0254);
    settings.beam_count = 48;
    SceneMaker maker;
    maker.add(height_field(2, 11, -2, 2, 0.02, ripples), truth.lambert_db);
    Sounding s(maker.make(), narrow_p900(), settings);
    s.request.switches.expected_power = true;
    s.ping_from(truth.sonar, {0, truth.tilt_rad, 0});
    const Difference d = compare(s, truth, truth.scatterers(s, 2, 11, -2, 2), 6, 4, 9.5);
    EXPECT_GT(d.lit, 3000) << period_m;
    EXPECT_GT(d.within_1_db, 0.99) << period_m;
    const std::string what = "bottom rippled by 1 cm every " + std::to_string(static_cast<int>(100 * period_m)) + " cm";
    record_below(no_number, what + ": rms over brute force", 0.7, d.rms_db, "dB");
  }
}

// One shadow ray for each scatterer, at a ridge that hides a part of the bed behind it.
TEST(Truths, ShadowsOnReliefAreThoseOfOneRayForEveryCell) {
  const auto rough = rough_relief(0.015, 40);
  const Relief relief(2, 11, -2, 2, 0.02, rough);
  const BruteForce truth{{0, 0, 1.2}, 0.12, -20, relief};
  PingSettings settings = native_rows(9, 0.0254);
  settings.beam_count = 48;
  SceneMaker maker;
  maker.add(height_field(2, 11, -2, 2, 0.02, rough), truth.lambert_db);
  Sounding s(maker.make(), narrow_p900(), settings);
  s.request.switches.expected_power = true;
  s.ping_from(truth.sonar, {0, truth.tilt_rad, 0});
  const Difference d = compare(s, truth, truth.scatterers(s, 2, 11, -2, 2), 4, 4, 8.5);
  EXPECT_GT(d.lit, 2000);
  EXPECT_GT(d.shadowed, 50) << "without shadows the test shows nothing";
  record_at_least(no_number, "relief of 1.5 cm rms: share of lit samples within 1 dB of one shadow ray for every cell", 0.95,
                  d.within_1_db, "");
  record_below(no_number, "the same relief: mean level in deep shadow, re the smooth bed", -12, db(d.shadow_re_bed), "dB");
}

TEST(Truths, AWorldFarFromItsOriginIsTheSame) {
  const auto look_from = [](Vec3d origin) {
    SceneMaker maker;
    maker.add(height_field(-2, 14, -10, 10, 0.1, rough_relief(0.03, 40)), -20, origin);
    maker.add(sphere(0.4, 4), -10, origin + Vec3d{5, 1, 0.4});
    maker.add_body(box({0.2, 0.2, 0.3}), -15, {origin + Vec3d{4, -1, 0.3}, {}});
    maker.add_point(origin + Vec3d{6, 0.5, 0.5}, -20);
    Sounding s(maker.make(), p900(), default_rows(10, 394));
    s.request.switches.expected_power = true;
    return s.ping_from(origin + Vec3d{0, 0, 2}, {0.02, 0.25, 0.1}).pressure_upa;
  };
  const std::vector<float> here = look_from({0, 0, 0}), there = look_from({2000, -2000, 0});
  double error = 0, power = 0;
  for (std::size_t i = 0; i < here.size(); ++i) {
    error += std::pow(static_cast<double>(here[i]) - static_cast<double>(there[i]), 2);
    power += std::pow(static_cast<double>(here[i]), 2);
  }
  EXPECT_GT(power, 0);
  record_below(no_number, "a world 2 km east and 2 km south: relative change of the picture", 1e-3, std::sqrt(error / power), "");
}

}  // namespace
}  // namespace sonar::test::brute_force_test
