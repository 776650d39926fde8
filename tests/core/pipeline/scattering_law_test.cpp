// Scattering laws: the formulae, the kernels' table, and the level of a bed that follows them (docs/acoustics.md, section 3).
#include "core/pipeline/scattering_law.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test::scattering_law_test {
namespace {

double db(double power_ratio) { return 10 * std::log10(power_ratio); }

Material gsab(float a_db, double b_deg, float c_db, float d = 2, float e_db = -200, double f_deg = 30) {
  Material m;
  m.law = ScatteringLaw::gsab;
  m.gsab = {a_db, static_cast<float>(rad_from_deg(b_deg)), c_db, d, e_db, static_cast<float>(rad_from_deg(f_deg))};
  return m;
}
std::vector<Material> seabeds() { return {gsab(-12, 5, -32), gsab(-8, 8, -24), gsab(-10, 20, -15)}; }  // mud, sand, gravel

/// Looks a value up in the same way as the kernels.
double looked_up(const LawTable& law, double cosine) {
  if (!law.table()) return law.mu * cosine * cosine;
  const double at = law_steps * std::sqrt(1 - cosine);
  const auto i = static_cast<std::size_t>(at);
  const double root = static_cast<double>(law.root[i]) +
                      (at - static_cast<double>(i)) * (static_cast<double>(law.root[i + 1]) - static_cast<double>(law.root[i]));
  return law.mu * root * root;
}

// Oracle 9 for d -> infinity, by the law that pings use. The integral of mu cos^2 dA over the lit half of a sphere is (2 pi /
// 3) mu a^2.
TEST(ScatteringLaw, Oracle09_LambertSphereFromAfar) {
  Material rough;
  rough.lambert_db = -13;
  rough.roughness_m = 0.01f;
  const double a = 0.25, mu = lambert_coefficient(-13), dt = 1e-4;
  const LawTable law = make_law(rough, 900e3, 1500, true);
  double by_ray = 0, by_cell = 0;
  for (double t = 0.5 * dt; t < 0.5 * pi; t += dt) {
    const double area = 2 * pi * a * a * std::sin(t) * dt;
    by_ray += scattering_strength(rough, std::cos(t), 900e3, 1500, true) * area;
    by_cell += looked_up(law, std::cos(t)) * area;
  }
  const double whole = 2 * pi / 3 * mu * a * a;
  record_oracle(9, "scattering law, from afar, over (2 pi / 3) mu a^2", 0, db(by_ray / whole), 0.05, "dB");
  record_oracle(9, "the kernels' law, from afar, over (2 pi / 3) mu a^2", 0, db(by_cell / whole), 0.05, "dB");
}

TEST(ScatteringLaw, GsabIsTheSumOfItsThreeTerms) {
  const Material m = gsab(-9, 6, -27, 3, -20, 25);
  for (const double deg : {0.0, 3.0, 10.0, 30.0, 60.0, 85.0}) {
    const double cosine = std::cos(rad_from_deg(deg));
    const double expected = std::pow(10, -0.9) * std::exp(-deg * deg / (2 * 36)) + std::pow(10, -2.7) * std::pow(cosine, 3) +
                            std::pow(10, -2.0) * std::exp(-deg * deg / (2 * 625));
    EXPECT_NEAR(db(scattering_strength(m, cosine, 900e3, 1500, false) / expected), 0, 1e-3) << deg;
  }
  // With D = 2 and no other terms it is Lambert's law.
  Material lambert;
  lambert.lambert_db = -24;
  for (const double cosine : {1.0, 0.7, 0.2, 0.01})
    EXPECT_NEAR(db(scattering_strength(gsab(-200, 10, -24), cosine, 1e6, 1500, false) /
                   scattering_strength(lambert, cosine, 1e6, 1500, false)),
                0, 1e-5);
}

TEST(ScatteringLaw, LambertNeedsNoTable) {
  Material m;
  m.lambert_db = -24;
  for (const bool specular : {false, true}) {
    const LawTable law = make_law(m, 900e3, 1500, specular);  // 1 mm is rough at 900 kHz
    EXPECT_EQ(law.table(), nullptr);
    EXPECT_EQ(law.mu, lambert_coefficient(static_cast<double>(m.lambert_db)));
  }
  m.roughness_m = 1e-5f;
  EXPECT_EQ(make_law(m, 900e3, 1500, false).table(), nullptr);
  EXPECT_NE(make_law(m, 900e3, 1500, true).table(), nullptr);
}

TEST(ScatteringLaw, TheTableFollowsTheLaw) {
  std::vector<Material> materials = seabeds();
  materials.push_back(gsab(-8, 2, -40));            // the steepest law that a scene file may contain
  materials.push_back(gsab(-8, 8, -24, 0.5f));      // the slowest cosine
  materials.push_back(gsab(-12, 5, -32, 10, -30));  // the fastest
  materials.emplace_back();
  materials.back().roughness_m = 1e-4f;
  for (std::size_t n = 0; n < materials.size(); ++n) {
    const LawTable law = make_law(materials[n], 900e3, 1500, true);
    for (double deg = 0.05; deg < 85; deg += 0.1) {
      const double cosine = std::cos(rad_from_deg(deg)), exact = scattering_strength(materials[n], cosine, 900e3, 1500, true);
      EXPECT_NEAR(db(looked_up(law, cosine) / exact), 0, n == 3 ? 0.3 : 0.05) << n << " at " << deg;
    }
  }
}

TEST(ScatteringLaw, TheTrendScalesWithFrequency) {
  for (Material m : {gsab(-20, 5, -32), Material{}}) {
    m.trend_db_per_decade = 12.5f;
    m.trend_reference_hz = 3e5f;
    const auto strength = [&](double hz) { return scattering_strength(m, 0.5, hz, 1500, false); };
    EXPECT_NEAR(db(strength(3e6) / strength(3e5)), 12.5, 1e-4);
    EXPECT_NEAR(db(looked_up(make_law(m, 9e5, 1500, false), 0.5) / strength(3e5)), 12.5 * std::log10(3.0), 0.02);
    m.trend_db_per_decade = 0;
    EXPECT_EQ(strength(3e6), strength(3e5));
    m.trend_db_per_decade = 40;
    m.trend_reference_hz = 1e4f;
    EXPECT_NEAR(scattering_strength(m, 1, 3e6, 1500, false), 1 / pi, 1e-6)
        << "a surface never scatters more power than it receives";
  }
}

// The energy that the specular echo loses is scattered: 0.6, 2.5 and 9.9 dB at 900 kHz; 3.4 and 13 dB at 2.1 MHz.
TEST(ScatteringLaw, RoughnessSharesEnergyBetweenMirrorAndScatter) {
  struct Case {
    double hz;
    float roughness_m;
    double mirror_loss_db;
  };
  for (const Case& c : {Case{900e3, 5e-5f, 0.617}, Case{900e3, 1e-4f, 2.469}, Case{900e3, 2e-4f, 9.87}, Case{2.1e6, 5e-5f, 3.36},
                        Case{2.1e6, 1e-4f, 13.44}}) {
    Material m;
    m.roughness_m = c.roughness_m;
    const auto diffuse = [&](double cosine) {
      return scattering_strength(m, cosine, c.hz, 1500, true) / scattering_strength(m, cosine, c.hz, 1500, false);
    };
    EXPECT_NEAR(diffuse(1), 1 - std::pow(10, -0.1 * c.mirror_loss_db), 1e-3) << c.hz << " " << c.roughness_m;
    // At oblique incidence the surface is smoother: the loss is proportional to the square of the cosine.
    EXPECT_NEAR(diffuse(0.5), 1 - std::pow(10, -0.1 * c.mirror_loss_db / 4), 1e-3) << c.hz << " " << c.roughness_m;
  }
  Material rough;
  rough.roughness_m = 5e-4f;  // 62 dB
  EXPECT_EQ(scattering_strength(rough, 1, 900e3, 1500, true), scattering_strength(rough, 1, 900e3, 1500, false));
}

std::shared_ptr<const Scene> bed_of(const Material& material) {
  Scene scene = *SceneMaker().add(height_field(-4, 14, -12, 12, 2, [](double, double) { return 0.0; }), -27).make();
  scene.materials.at(0) = material;
  return std::make_shared<const Scene>(std::move(scene));
}

/// E|s|^2 at azimuth 0 over a flat bed, conical beams, no elevation pattern: integral of S_b(a) T^2 p^2 over the strip dA = dx
/// (r du), r^2 = x^2 + h^2, within the fan. It also holds straight down, where oracle 8 has a pole.
double bed_power(const Sounding& s, const Material& material, double range_m, double height_m, double tilt_rad) {
  const BeamPattern& pattern = s.mode().pattern;
  const double theta = effective_beam_width_u(
      pattern.azimuth_taper, aperture_in_wavelengths(pattern.azimuth_taper, static_cast<double>(pattern.azimuth_width_rad)));
  const double half_fan = 2.3 * static_cast<double>(pattern.elevation_width_rad) / 2;
  const reference::Medium medium = s.medium();
  double sum = 0;
  const double dx = 5e-4, reach = 0.06;  // the pulse is 25 mm
  const auto ahead = [&](double r) { return std::sqrt(std::max(0.0, r * r - height_m * height_m)); };
  for (double x = -2 + dx / 2; x < ahead(range_m + reach); x += dx) {
    if (x > 0 && x < ahead(range_m - reach) - dx) x = ahead(range_m - reach);
    if (std::abs(std::atan2(-height_m, x) + tilt_rad) > half_fan) continue;
    const double r = std::hypot(x, height_m), p = envelope(s.envelope_hz(), 2 * (r - range_m) / 1500);
    if (p < 1e-6) continue;
    const double strength =
        scattering_strength(material, height_m / r, static_cast<double>(s.mode().centre_hz), 1500, s.request.switches.specular);
    sum += strength * std::pow(medium.source_upa * two_way_transmission(r, medium.absorption_np_per_m) * p, 2) * r * theta * dx;
  }
  return sum;
}

TEST(ScatteringLaw, LevelOfABedThatFollowsGsab) {
  const double height = 2;
  std::vector<Material> materials = seabeds();
  materials.emplace_back();  // Lambert, with a weak specular part
  materials.back().roughness_m = 1.5e-4f;
  for (const Material& material : materials)
    for (const double tilt : {rad_from_deg(75), 0.45, 0.25}) {
      Sounding s(bed_of(material), without_elevation_pattern(p900()), native_rows(9, 0.0254));
      s.request.switches.expected_power = true;
      s.request.switches.specular = material.law == ScatteringLaw::lambert;  // its specular echo is straight down
      const bool straight_down = tilt > 1;
      const int block = straight_down ? 6 : 20;
      const double nearest = straight_down ? (s.request.switches.specular ? 2.12 : 2.0) : height / std::sin(0.4 + tilt) + 0.1;
      const double farthest = straight_down ? 2.5 : 8.5;
      std::vector<double> power(static_cast<std::size_t>(s.rows()));
      const int pings = straight_down ? 4 : 1;
      int beams = 0;
      for (int ping = 1; ping <= pings; ++ping) {
        s.request.seed = Seed{static_cast<std::uint64_t>(ping)};
        s.ping_from({0, 0, height}, {0, tilt, 0});
        for (int j = s.beam_at(rad_from_deg(3)); j <= s.beam_at(rad_from_deg(-3)); ++j, ++beams)
          for (int row = 0; row < s.rows(); ++row) power[static_cast<std::size_t>(row)] += s.power(row, j);
      }
      int blocks = 0;
      for (int row = static_cast<int>(s.row_of_range(nearest)) + 1; row + block < s.row_of_range(farthest);
           row += block, ++blocks) {
        double ratio = 0;
        for (int n = row; n < row + block; ++n)
          ratio += power[static_cast<std::size_t>(n)] / beams / bed_power(s, material, s.range_of_row(n), height, tilt) / block;
        record_oracle(8,
                      std::string(material.law == ScatteringLaw::gsab ? "GSAB" : "smooth Lambert") + " seabed, grazing " +
                          (straight_down ? "53 to 90 deg"
                           : tilt > 0.4  ? "13 to 48 deg"
                                         : "13 to 37 deg"),
                      0, db(ratio), 0.3, "dB");
      }
      EXPECT_GE(blocks, 5);
    }
}

}  // namespace
}  // namespace sonar::test::scattering_law_test
