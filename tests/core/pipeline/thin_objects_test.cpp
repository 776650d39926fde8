// Bodies that are too thin for the depth map. Bodies a few centimetres thick echo only from the side that faces the sonar.
// Bodies close behind an opaque face do not echo. Expected powers are compared with integrals in double.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <tuple>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "core/scene/closed_mesh.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test::thin_objects_test {
namespace {

double db(double power_ratio) { return 10 * std::log10(power_ratio); }
constexpr double lambert_db = -15;

struct Look {
  const char* name;
  FrequencyMode mode;
  double range_m, pulse_m;
};
/// Returns the products' beams, also with the pulses of their longest ranges.
std::vector<Look> looks() {
  return {{"P900, 5 m", p900(), 5, 0.0254},
          {"M1200d HF, 9 m", oculus_high(), 9, 0.9 * 10 / 437},
          {"M1200d LF, 28 m", oculus_low(), 28, 0.06},
          {"pulse of 0.4 m, 60 m", oculus_low(), 60, 0.4}};
}

Sounding looking_at(std::shared_ptr<const Scene> scene, const Look& look, SimdLevel level = SimdLevel::automatic) {
  FrequencyMode mode = without_elevation_pattern(silent(look.mode));
  mode.beam_spacing = BeamSpacing::uniform_in_sine;
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(40));
  Sounding s(std::move(scene), mode, native_rows(look.range_m + 6 * look.pulse_m + 1, look.pulse_m),
             {.threads = 2, .engine = {.simd = level}});
  s.request.switches.expected_power = true;
  return s;
}

/// sum sigma_i / r_i^4 of all echoes between two ranges, from the beams of a whole ping. Each echo is counted theta_eff tau_eff
/// times.
double echo_per_m2(const Sounding& s) {
  double sum = 0;
  for (int j = 0; j < s.beams(); ++j)
    for (int row = 0; row < s.rows(); ++row) sum += s.power(row, j);
  const Taper taper = s.mode().pattern.azimuth_taper;
  const double theta =
      effective_beam_width_u(taper, aperture_in_wavelengths(taper, static_cast<double>(s.mode().pattern.azimuth_width_rad)));
  const double du = s.beam_sine(0) - s.beam_sine(1), source = s.medium().source_upa;
  return sum * 2 * s.request.settings.range_bin_m / 1500 * du / (theta * energy_width_s(s.envelope_hz()) * source * source);
}

/// Returns an upright closed cylinder about the origin.
Mesh closed_pole(double radius_m, double half_height_m) {
  constexpr std::uint32_t sides = 96;
  Mesh mesh;
  for (std::uint32_t i = 0; i < sides; ++i) {
    const double a = 2 * pi * i / sides;
    for (const double z : {-half_height_m, half_height_m})
      mesh.vertices.push_back(to_float({radius_m * std::cos(a), radius_m * std::sin(a), z}));
  }
  mesh.vertices.push_back(to_float({0, 0, -half_height_m}));
  mesh.vertices.push_back(to_float({0, 0, half_height_m}));
  for (std::uint32_t i = 0; i < sides; ++i) {
    const std::uint32_t a = 2 * i, b = 2 * ((i + 1) % sides);
    mesh.triangles.insert(mesh.triangles.end(),
                          {{a, b, b + 1}, {a, b + 1, a + 1}, {b, a, 2 * sides}, {a + 1, b + 1, 2 * sides + 1}});
  }
  return mesh;
}

/// sum sigma_i / r_i^4 over the side of a cylinder that faces the origin. Its axis is upright through (x, y).
double pole_echo_per_m2(double radius_m, double half_height_m, double x, double y) {
  const double mu = lambert_coefficient(lambert_db), dt = 2 * pi / 2000, dz = half_height_m / 500;
  double sum = 0;
  for (double t = dt / 2; t < 2 * pi; t += dt)
    for (double z = -half_height_m + dz / 2; z < half_height_m; z += dz) {
      const Vec3d p{x + radius_m * std::cos(t), y + radius_m * std::sin(t), z};
      const double cosine = -(std::cos(t) * p.x + std::sin(t) * p.y) / length(p);
      if (cosine > 0) sum += lambert_per_area(mu, cosine) * radius_m * dt * dz / std::pow(length(p), 4);
    }
  return sum;
}

TEST(ThinObjects, SpheresFromOneCentimetreFollowLambertsLaw) {
  for (const Look& look : looks())
    for (const double a : {0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.4, 1.0}) {
      double worst = 0;
      for (const double u : {0.0, 0.0613}) {
        const Vec3d at{look.range_m * std::sqrt(1 - u * u), look.range_m * u, 0.13 * a};
        Sounding s = looking_at(SceneMaker().add(sphere(a, 5), lambert_db, at).make(), look);
        s.ping();
        const double off = db(echo_per_m2(s) / reference::sphere_echo_per_m2(lambert_coefficient(lambert_db), a, length(at)));
        if (std::abs(off) > std::abs(worst)) worst = off;
      }
      record_oracle(9, std::string("thin bodies: sphere, ") + look.name, 0, worst, 0.3, "dB");
    }
}

// For the pulses of long ranges, cells are coarser than the first cubes of a small body.
TEST(ThinObjects, SpheresEchoInSpeckleWithLongPulses) {
  for (const double range : {64.0, 120.0, 200.0}) {
    const Look look{"long", oculus_low(), 30, 0.9 * range / 437};
    for (const bool aside : {false, true}) {
      const double down = aside ? 0.893 : 0;  // the first side lobe
      const auto scene = SceneMaker().add(sphere(1, 5), lambert_db, {30 * std::cos(down), 0, 30 * std::sin(down)}).make();
      Sounding s = looking_at(scene, look);
      if (aside) s = Sounding(scene, silent(look.mode), s.request.settings);
      s.request.switches.expected_power = true;
      s.request.switches.side_lobes = aside;
      double speckle = 0;
      const auto echo = [&] {
        s.ping();
        return echo_per_m2(s);
      };
      const double expected = echo();
      s.request.switches.expected_power = false;
      for (std::uint64_t seed = 1; seed <= 12; ++seed) {
        s.request.seed = Seed{seed};
        speckle += echo() / 12;
      }
      EXPECT_NEAR(db(speckle / expected), 0, 2) << range << (aside ? ", side lobe" : "");
    }
  }
}

TEST(ThinObjects, PolesFromOneCentimetreFollowLambertsLaw) {
  constexpr double half_height = 0.5;
  for (const Look& look : looks())
    for (const double a : {0.01, 0.02, 0.05, 0.2, 1.0}) {
      const double y = 0.04 * look.range_m;
      Sounding s = looking_at(SceneMaker().add(closed_pole(a, half_height), lambert_db, {look.range_m, y, 0}).make(), look);
      s.ping();
      record_oracle(9, std::string("thin bodies: pole, ") + look.name, 0,
                    db(echo_per_m2(s) / pole_echo_per_m2(a, half_height, look.range_m, y)), 0.3, "dB");
    }
}

TEST(ThinObjects, APlateOfAnyThicknessEchoesOnce) {
  constexpr double half = 0.3;
  for (const Look& look : looks())
    for (const double thickness : {0.001, 0.01, 0.03, 0.1}) {
      Sounding s = looking_at(
          SceneMaker().add(box({thickness / 2, half, half}), lambert_db, {look.range_m + thickness / 2, 0, 0}).make(), look);
      s.ping();
      double expected = 0;  // over the face
      const double mu = lambert_coefficient(lambert_db), step = 0.005;
      for (double y = -half + step / 2; y < half; y += step)
        for (double z = -half + step / 2; z < half; z += step) {
          const double r = std::hypot(look.range_m, y, z);
          expected += lambert_per_area(mu, look.range_m / r) * step * step / std::pow(r, 4);
        }
      record_oracle(9, std::string("thin bodies: plate, ") + look.name, 0, db(echo_per_m2(s) / expected), 0.3, "dB");
    }
}

// A single sheet, and a mesh whose triangles have inconsistent directions.
TEST(ThinObjects, OpenMeshesEchoFromBothSides) {
  const Look look = looks()[0];
  std::vector<double> level;
  for (const bool turned : {false, true}) {
    Mesh sheet = wall(0.3, 0.3);
    Sounding s = looking_at(
        SceneMaker().add(sheet, lambert_db, {look.range_m, 0, 0}, quat_from_rpy({0, 0, turned ? pi : 0})).make(), look);
    s.ping();
    level.push_back(db(echo_per_m2(s)));
  }
  EXPECT_NEAR(level[0], level[1], 0.05);
  Mesh muddled = box({0.01, 0.3, 0.3});
  std::swap(muddled.triangles[0][0], muddled.triangles[0][1]);
  EXPECT_EQ(skin_of(muddled).outward, 0);
  Sounding s = looking_at(SceneMaker().add(muddled, lambert_db, {look.range_m, 0, 0}).make(), look);
  s.ping();
  EXPECT_GT(db(echo_per_m2(s)), level[0] - 0.3) << "no side of the muddled box is lost";
}

TEST(ThinObjects, AClosedRoomEchoesFromWithin) {
  // Normals point outwards. Seen from inside, all of them point away.
  Sounding closed = looking_at(SceneMaker().add(box({4, 3, 2}), lambert_db, {1, 0.5, 0}).make(), looks()[0]);
  Mesh open = box({4, 3, 2});
  open.triangles.erase(open.triangles.begin() + 8, open.triangles.begin() + 10);  // without the wall behind the sonar
  Sounding from_open = looking_at(SceneMaker().add(open, lambert_db, {1, 0.5, 0}).make(), looks()[0]);
  closed.ping(), from_open.ping();
  EXPECT_GT(echo_per_m2(closed), 0);
  EXPECT_NEAR(db(echo_per_m2(closed) / echo_per_m2(from_open)), 0, 0.01);
}

TEST(ThinObjects, WhichMeshesAreClosed) {
  EXPECT_EQ(skin_of(box({1, 2, 3})).outward, 1);
  EXPECT_NEAR(skin_of(box({1, 2, 3})).area_m2, 88, 1e-4);
  EXPECT_EQ(skin_of(sphere(0.1, 3)).outward, 1);
  EXPECT_EQ(skin_of(closed_pole(0.1, 1)).outward, 1);
  EXPECT_EQ(skin_of(wall(1, 1)).outward, 0);
  EXPECT_EQ(skin_of(height_field(0, 2, 0, 2, 0.1, rough_relief(0.05, 9))).outward, 0);
  Mesh inside_out = box({1, 1, 1});
  for (auto& t : inside_out.triangles) std::swap(t[0], t[1]);
  EXPECT_EQ(skin_of(inside_out).outward, -1);
  Mesh soup;  // each triangle has its own vertices
  for (const auto& t : box({1, 1, 1}).triangles) {
    const auto n = static_cast<std::uint32_t>(soup.vertices.size());
    for (const std::uint32_t i : t) soup.vertices.push_back(box({1, 1, 1}).vertices[i]);
    soup.triangles.push_back({n, n + 1, n + 2});
  }
  EXPECT_EQ(skin_of(soup).outward, 1);
  EXPECT_TRUE(encloses(soup, {0.9, -0.9, 0.9}));
  EXPECT_FALSE(encloses(soup, {1.1, 0, 0}));
}

/// Returns the energy of a plate with the screen before it divided by that without [dB]. The numbers of the two objects differ
/// by the parameter.
double heard_behind_screen_db(const Look& look, double yaw, double gap_m, int apart, SimdLevel level = SimdLevel::automatic) {
  const auto heard = [&](bool screened) {
    const Quatd turn = quat_from_rpy({0, 0, yaw});
    const Vec3d at{look.range_m, 0.02 * look.range_m, 0};
    SceneMaker maker;
    maker.add(wall(0.2, 0.2), -10, at + rotate(turn, {gap_m, 0, 0}), turn);
    for (int i = 1; i < apart; ++i) maker.add(wall(0.1, 0.1), -10, {-2.0 - i, 0, 0});  // behind the sonar
    if (screened) maker.add(wall(0.9, 0.9), -150, at, turn);
    Sounding s = looking_at(maker.make(), look, level);
    s.ping();
    return echo_per_m2(s);
  };
  return db(heard(true) / heard(false));
}

TEST(ThinObjects, APlateBehindAnOpaqueScreenHasNoEcho) {
  for (const Look& look : looks())
    for (const double yaw : {0.0, 0.5})  // the screen faces the sonar exactly or almost
      for (const double gap : {0.005, 0.01, 0.03, 0.04, 0.2})
        record_below(no_number, std::string("plate from 5 mm behind a screen, ") + look.name, -25,
                     heard_behind_screen_db(look, yaw, gap, 1), "dB");
}

// Numbers whose last bits are equal.
TEST(ThinObjects, ObjectsOfLargeScenesAreDistinguished) {
  for (const SimdLevel level : {SimdLevel::portable, SimdLevel::avx2, SimdLevel::avx512})
    for (const double yaw : {0.0, 0.5})
      for (const int apart : {63, 64, 1024})
        EXPECT_LT(heard_behind_screen_db(looks()[0], yaw, 0.01, apart, level), -25) << apart << " apart";
}

}  // namespace
}  // namespace sonar::test::thin_objects_test
