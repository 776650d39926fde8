// Paths via flat mirrors through the whole engine: positions and levels of the ghosts of points, and ghosts that must not
// appear.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test::multipath_test {
namespace {

constexpr double silent_db = -80;  // makes the diffuse echoes of the mirrors themselves negligible

Mesh sheet(double length_x_m, double length_y_m) {
  return height_field(-length_x_m / 2, length_x_m / 2, -length_y_m / 2, length_y_m / 2, 5, [](double, double) { return 0.0; });
}
Quatd upright_along_x() { return quat_from_rpy({pi / 2, 0, 0}); }  // turns a level sheet into a side wall with its normal along y

struct SpecularMaterial {
  float reflection = -1, roughness_m = 0;
};
/// Returns the scene with its first `count` materials as mirrors.
std::shared_ptr<const Scene> mirrored(const SceneMaker& maker, std::size_t count, SpecularMaterial as = {}) {
  auto scene = std::make_shared<Scene>(*maker.make());
  for (std::size_t m = 0; m < count; ++m) {
    scene->materials[m].reflection = as.reflection;
    scene->materials[m].roughness_m = as.roughness_m;
  }
  for (std::size_t m = count; m < scene->materials.size(); ++m) scene->materials[m].reflection = 0;
  return scene;
}

FrequencyMode without_patterns(FrequencyMode mode) {
  mode.pattern.azimuth_taper = Taper::unit;
  return without_elevation_pattern(mode);
}

/// Returns the peak of a beam's echo within 5 rows of a range.
Peak peak_near(const Sounding& s, double range_m, int beam) {
  const int middle = static_cast<int>(std::lround(s.row_of_range(range_m)));
  int best = middle;
  for (int n = middle - 5; n <= middle + 5; ++n)
    if (s.pressure(n, beam) > s.pressure(best, beam)) best = n;
  Peak p = log_parabola(s.pressure(best - 1, beam), s.pressure(best, beam), s.pressure(best + 1, beam));
  p.offset += best;
  return p;
}
double loudest_within(const Sounding& s, double from_m, double to_m, int beam) {
  double most = 0;
  for (int n = static_cast<int>(s.row_of_range(from_m)); n <= static_cast<int>(s.row_of_range(to_m)); ++n)
    most = std::max(most, s.pressure(n, beam));
  return most;
}

/// A still surface at z = 0 and a point. The sonar looks along +x.
struct UnderSurface {
  double sonar_depth_m, point_depth_m, distance_m;
  double direct_m() const { return std::hypot(distance_m, point_depth_m - sonar_depth_m); }
  double mirrored_m() const { return std::hypot(distance_m, point_depth_m + sonar_depth_m); }
  std::shared_ptr<const Scene> scene(SpecularMaterial surface = {}) const {
    return mirrored(SceneMaker().add(sheet(40, 40), silent_db).add_point({distance_m, 0, -point_depth_m}, -20), 1, surface);
  }
  Sounding sounding(const FrequencyMode& mode, SpecularMaterial surface = {}) const {
    PingSettings settings = native_rows(12, 0.0254);
    settings.beam_count = 511;  // the middle beam looks straight ahead
    Sounding s(scene(surface), mode, settings);
    s.request.sonar_in_world.position_m = {0, 0, -sonar_depth_m};
    s.request.switches.multipath = true;
    return s;
  }
};

TEST(Multipath, Oracle38_RangesOfSurfaceGhosts) {
  for (const UnderSurface& u : {UnderSurface{1, 1.5, 8}, UnderSurface{0.8, 0.6, 5}, UnderSurface{1.5, 1.2, 9.5}}) {
    Sounding s = u.sounding(p900());
    s.ping();
    const double both = 0.5 * (u.direct_m() + u.mirrored_m());
    record_oracle(38, "range of the ghost by the surface one way", s.row_of_range(both), peak_near(s, both, 255).offset, 1,
                  "lines");
    record_oracle(38, "range of the ghost by the surface both ways", s.row_of_range(u.mirrored_m()),
                  peak_near(s, u.mirrored_m(), 255).offset, 1, "lines");
    EXPECT_GT(peak_near(s, both, 255).height, 0.05 * peak_near(s, u.direct_m(), 255).height);
  }
}

TEST(Multipath, Oracle39_LevelsOfSurfaceGhosts) {
  for (const bool expected_power : {false, true})
    for (const UnderSurface& u : {UnderSurface{1, 1.5, 8}, UnderSurface{0.8, 0.6, 5}, UnderSurface{1.5, 1.2, 9.5}}) {
      Sounding s = u.sounding(silent(without_patterns(p900())));
      s.request.switches.expected_power = expected_power;
      s.ping();
      const double direct = peak_near(s, u.direct_m(), 255).height, r = u.direct_m(), mirrored = u.mirrored_m();
      const auto over_direct_db = [&](double range) { return 20 * std::log10(peak_near(s, range, 255).height / direct); };
      record_oracle(39, "ghost one way over the direct echo", 20 * std::log10(2 * r / mirrored),
                    over_direct_db(0.5 * (r + mirrored)), 0.3, "dB");
      record_oracle(39, "ghost both ways over the direct echo", 40 * std::log10(r / mirrored), over_direct_db(mirrored), 0.3,
                    "dB");
    }
}

TEST(Multipath, ReflectionLowersGhostsOncePerBounce) {
  const UnderSurface u{1, 1.5, 8};
  const auto level_db = [&](float reflection, double range) {
    Sounding s = u.sounding(silent(without_patterns(p900())), {.reflection = reflection});
    s.ping();
    return 20 * std::log10(peak_near(s, range, 255).height);
  };
  const double both = 0.5 * (u.direct_m() + u.mirrored_m());
  EXPECT_NEAR(level_db(-1, both) - level_db(0.5f, both), 6.02, 0.05);
  EXPECT_NEAR(level_db(-1, u.mirrored_m()) - level_db(0.5f, u.mirrored_m()), 12.04, 0.05);
}

TEST(Multipath, GhostsOfOneBounceArePhaseInverted) {
  const UnderSurface u{1, 1.5, 8};
  std::complex<float> signal[2];
  const double both = 0.5 * (u.direct_m() + u.mirrored_m());
  for (const int sign : {0, 1}) {
    Sounding s = u.sounding(p900(), {.reflection = sign == 0 ? 1.0f : -1.0f});
    s.request.switches.keep_beams = true;
    s.ping();
    const auto row = static_cast<std::size_t>(std::lround(peak_near(s, both, 255).offset));
    signal[sign] = s.last().beam_signal_upa[row * 511 + 255];
  }
  EXPECT_LT(std::abs(signal[0] + signal[1]), 1e-3f * std::abs(signal[0]));
  EXPECT_GT(std::abs(signal[0]), 0);
}

TEST(Multipath, ARoughSurfaceHasNoGhosts) {
  const UnderSurface u{1.5, 1.2, 6};
  const double wave_number = 2 * pi * 900e3 / 1500;
  for (const double kh : {10.0, 40.0}) {
    const float roughness_m = static_cast<float>(kh / wave_number);
    Sounding with = u.sounding(p900(), {.roughness_m = roughness_m}), without = u.sounding(p900(), {.roughness_m = roughness_m});
    without.request.switches.multipath = false;
    EXPECT_EQ(with.ping().pressure_upa, without.ping().pressure_upa) << kh;
  }
  // Between the extremes the reflectance is exp(-2 k^2 h^2 cos^2) at this angle.
  const double cosine = (1.5 + 1.2) / u.mirrored_m(), kh = 1.5;
  Sounding smooth = u.sounding(p900()), rougher = u.sounding(p900(), {.roughness_m = static_cast<float>(kh / wave_number)});
  smooth.ping(), rougher.ping();
  const double both = 0.5 * (u.direct_m() + u.mirrored_m());
  EXPECT_NEAR(std::log(peak_near(rougher, both, 255).height / peak_near(smooth, both, 255).height),
              -2 * kh * kh * cosine * cosine, 0.01);
}

TEST(Multipath, GhostsOfASideWallAppearWhereTheyArriveFrom) {
  const Vec3d point{8, 1, 0}, image{8, 5, 0};  // the wall is at y = 3
  const double r = length(point), mirrored_m = length(image), both = 0.5 * (r + mirrored_m);
  Sounding s(mirrored(SceneMaker().add(sheet(40, 40), silent_db, {0, 3, 0}, upright_along_x()).add_point(point, -20), 1), p900(),
             native_rows(12, 0.0254));
  s.request.switches.multipath = true;
  s.ping();
  const int direct_beam = s.beam_at(std::atan2(point.y, point.x)), mirror_beam = s.beam_at(std::atan2(image.y, image.x));
  EXPECT_EQ(s.loudest_beam(static_cast<int>(std::lround(s.row_of_range(r)))), direct_beam);
  EXPECT_EQ(s.loudest_beam(static_cast<int>(std::lround(s.row_of_range(mirrored_m)))), mirror_beam);
  // Out via the mirror and back directly, and the reverse: one range, two bearings.
  const double by_mirror = peak_near(s, both, mirror_beam).height, directly = peak_near(s, both, direct_beam).height;
  EXPECT_NEAR(by_mirror / directly, 1, 0.02);
  EXPECT_NEAR(directly / peak_near(s, r, direct_beam).height,
              r / mirrored_m * std::exp(-s.medium().absorption_np_per_m * (mirrored_m - r)), 0.02);
  const int between = s.beam_at(0.5 * (std::atan2(point.y, point.x) + std::atan2(image.y, image.x)));
  EXPECT_LT(loudest_within(s, both - 0.1, both + 0.1, between), 0.04 * directly);
}

TEST(Multipath, TwoWallsMakeImagesOfImages) {
  // Surface at z = 0, wall at y = 3. The corner's image of the point lies across both.
  const Vec3d point{7, 1, -1}, sonar{0, 0, -0.8};
  SceneMaker maker;
  maker.add(sheet(40, 40), silent_db).add(sheet(40, 40), silent_db, {0, 3, 0}, upright_along_x()).add_point(point, -20);
  Sounding s(mirrored(maker, 2), p900(), native_rows(12, 0.0254));
  s.request.sonar_in_world.position_m = sonar;
  s.request.switches.multipath = true;
  s.ping();
  const Vec3d corner{point.x, 6 - point.y, -point.z};
  const double range = length(corner - sonar), r = length(point - sonar);
  const int beam = s.beam_at(std::asin((corner.y - sonar.y) / range));
  EXPECT_NEAR(peak_near(s, range, beam).offset, s.row_of_range(range), 1);
  EXPECT_GT(peak_near(s, range, beam).height, 0.1 * peak_near(s, r, s.beam_at(std::asin(point.y / r))).height);
  // One way is straight, the other is via both mirrors.
  const double mixed = 0.5 * (range + r);
  EXPECT_NEAR(peak_near(s, mixed, beam).offset, s.row_of_range(mixed), 1);
}

TEST(Multipath, AnObjectThatHidesTheMirrorHidesTheGhost) {
  const UnderSurface u{1, 1.5, 8};
  const auto ghost = [&](Vec3d box_at) {
    const SceneMaker maker = SceneMaker()
                                 .add(sheet(40, 40), silent_db)
                                 .add(box({0.1, 0.3, 0.15}), silent_db, box_at)
                                 .add_point({u.distance_m, 0, -u.point_depth_m}, -20);
    Sounding s(mirrored(maker, 1), p900(), native_rows(12, 0.0254));
    s.request.sonar_in_world.position_m = {0, 0, -u.sonar_depth_m};
    s.request.switches.multipath = true;
    s.ping();
    return loudest_within(s, u.mirrored_m() - 0.1, u.mirrored_m() + 0.1, 255);
  };
  const double bounce_x = u.distance_m * u.sonar_depth_m / (u.sonar_depth_m + u.point_depth_m);
  const double free = ghost({bounce_x, 4, -0.1});
  EXPECT_LT(ghost({bounce_x, 0, -0.1}), 0.01 * free);               // below the point of reflection
  EXPECT_LT(ghost({0.5 * bounce_x, 0, -0.5}), 0.01 * free);         // on the way to the mirror
  EXPECT_LT(ghost({0.5 * (bounce_x + 8), 0, -0.75}), 0.01 * free);  // on the way from the mirror
  EXPECT_NEAR(ghost({4, 0, -3}), free, 1e-6 * free);                // elsewhere
}

TEST(Multipath, IsOffByDefaultAndChangesNothingWithoutMirrors) {
  EXPECT_FALSE(Switches{}.multipath);
  SceneMaker maker;
  maker.add(height_field(0, 12, -12, 12, 0.5, rough_relief(0.05, 32)), -25, {0, 0, -2}).add(sphere(0.4, 4), -20, {6, 1, -1.5});
  std::vector<float> pressure[2];
  for (const bool on : {false, true}) {
    Sounding s(maker.make(), p900(), default_rows(10, 360));
    s.request.switches.multipath = on;
    pressure[on] = s.ping().pressure_upa;
  }
  EXPECT_EQ(pressure[0], pressure[1]);
}

}  // namespace
}  // namespace sonar::test::multipath_test
