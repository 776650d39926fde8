// Ghosts of surfaces: the cells of objects before a mirror, compared with closed forms and with scenes that contain the images.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/pipeline/pulses/spectral.hpp"
#include "core/scene/shapes/primitives.hpp"
#include "core/scene/specular/flat_faces.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

constexpr double silent_db = -80;

Mesh sheet(double length_x_m, double length_y_m) {
  return height_field(-length_x_m / 2, length_x_m / 2, -length_y_m / 2, length_y_m / 2, 5, [](double, double) { return 0.0; });
}
std::shared_ptr<Scene> with_mirrors(const SceneMaker& maker, std::size_t count, float reflection = -1) {
  auto scene = std::make_shared<Scene>(*maker.make());
  for (std::size_t m = 0; m < scene->materials.size(); ++m) {
    scene->materials[m].reflection = m < count ? reflection : 0.0f;
    scene->materials[m].roughness_m = 0;
  }
  return scene;
}

/// Returns the sum of |s|^2 over beams [from, to) and over the rows of a range interval.
double energy(const Sounding& s, double from_m, double to_m, int first_beam, int last_beam) {
  double sum = 0;
  for (int n = static_cast<int>(s.row_of_range(from_m)); n <= static_cast<int>(s.row_of_range(to_m)); ++n)
    for (int j = first_beam; j < last_beam; ++j) sum += s.power(n, j);
  return sum;
}

TEST(MultipathCells, GhostsOfALambertSphereHaveTheirLevel) {
  // A Lambert sphere that is seen by one path and lit by another, with the angle b between them, scatters (sin b + (pi - b) cos
  // b) / pi of its echo straight back. The amplitudes of the two directions add.
  const double sonar_depth = 1, depth = 1.5, distance = 8, radius = 0.04;
  Sounding s(with_mirrors(SceneMaker().add(sheet(40, 40), silent_db).add(sphere(radius, 5), -20, {distance, 0, -depth}), 1),
             silent(without_elevation_pattern(p900())), native_rows(12, 0.0254));
  s.request.sonar_in_world.position_m = {0, 0, -sonar_depth};
  s.request.switches.multipath = true;
  s.request.switches.expected_power = true;
  s.ping();
  const double r = std::hypot(distance, depth - sonar_depth), mirrored = std::hypot(distance, depth + sonar_depth);
  const auto energy_at = [&](double range) { return energy(s, range - 0.08, range + 0.08, 200, 312); };
  const double apart = std::atan2(depth + sonar_depth, distance) - std::atan2(sonar_depth - depth, distance);
  const double phase = (std::sin(apart) + (pi - apart) * std::cos(apart)) / pi;
  const double direct = energy_at(r);
  record_oracle(39, "ghost one way of a Lambert sphere over its direct echo, energy",
                20 * std::log10(2 * r / mirrored) + 10 * std::log10(phase),
                10 * std::log10(energy_at(0.5 * (r + mirrored)) / direct), 0.3, "dB");
  record_oracle(39, "ghost both ways of a Lambert sphere over its direct echo, energy", 40 * std::log10(r / mirrored),
                10 * std::log10(energy_at(mirrored) / direct), 0.3, "dB");
}

/// Adds objects with corners and slopes, without any symmetry.
SceneMaker& add_things(SceneMaker& maker, double wall_y, bool mirrored) {
  const double side = mirrored ? -1 : 1;
  const auto at = [&](double x, double y, double z) { return Vec3d{x, wall_y + side * y, z}; };
  return maker.add(box({0.3, 0.1, 0.2}), -20, at(5, -1.2, 0.1), quat_from_rpy({0, 0, side * 0.5}))
      .add(sphere(0.25, 4), -20, at(6, -2, -0.3))
      .add(box({0.05, 0.4, 0.4}), -20, at(6.5, -1.4, 0), quat_from_rpy({0, 0, side * -0.2}));
}

TEST(MultipathCells, ViewInAMirrorIsThatOfTheMirroredScene) {
  // A baffle hides the objects from the sonar. The sonar sees them only in a side wall, as if they were behind the wall.
  const double wall_y = 2.5;
  SceneMaker real, image;
  real.add(sheet(40, 40), silent_db, {0, wall_y, 0}, quat_from_rpy({pi / 2, 0, 0}));
  real.add(box({0.05, 1.5, 3}), silent_db, {2, -0.6, 0});
  image.add(box({0.05, 1.5, 3}), silent_db, {2, -0.6, 0});
  Sounding with(with_mirrors(add_things(real, wall_y, false), 1), p900(), native_rows(10, 0.0254));
  Sounding plain(with_mirrors(add_things(image, wall_y, true), 0), p900(), native_rows(10, 0.0254));
  for (Sounding* s : {&with, &plain}) {
    s->request.switches.expected_power = true;
    s->request.switches.multipath = true;
    s->ping();
  }
  double largest = 0, wrong = 0, whole = 0;
  for (int n = 0; n < with.rows(); ++n)
    for (int j = 0; j < with.beams(); ++j) largest = std::max(largest, plain.power(n, j));
  ASSERT_GT(largest, 0);
  for (int n = 0; n < with.rows(); ++n)
    for (int j = 0; j < with.beams(); ++j) {
      whole += plain.power(n, j);
      wrong += std::abs(with.power(n, j) - plain.power(n, j));
    }
  EXPECT_LT(wrong / whole, 0.08);  // cells of the mirrored objects have other draws, and shadows have edges
  const double level_db = 10 * std::log10(energy(with, 4, 9, 0, 512) / energy(plain, 4, 9, 0, 512));
  record_oracle(no_number, "energy of what is seen in a mirror alone over that of the mirrored scene", 0, level_db, 0.15, "dB");
}

TEST(MultipathCells, ARippledBedHasNoDarkBandsInAMirror) {
  // Rays can hit equal phases of ripples. A bed that is seen only in a ceiling must be as evenly lit as a bed that is seen
  // directly.
  const double ceiling_z = 0.5, bed_z = -1, image_z = 2 * ceiling_z - bed_z;
  const auto ripples = [](double x) { return -0.01 * std::sin(2 * pi * x / 0.55); };
  SceneMaker real, image;
  real.add(sheet(40, 40), silent_db, {0, 0, ceiling_z});
  real.add(height_field(2, 11, -2, 2, 0.02, [&](double x, double) { return bed_z + ripples(x); }), -20);
  image.add(height_field(2, 11, -2, 2, 0.02, [&](double x, double) { return image_z - ripples(x); }), -20);
  FrequencyMode mode = p900();
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(8));
  PingSettings settings = native_rows(10, 0.0254);
  settings.beam_count = 48;
  std::vector<std::unique_ptr<Sounding>> both;
  for (SceneMaker* maker : {&real, &image}) {
    maker->add(box({0.02, 2, 1}), silent_db, {1, 0, -0.95});  // hides the bed from direct view
    both.push_back(std::make_unique<Sounding>(with_mirrors(*maker, maker == &real ? 1 : 0), mode, settings));
    both.back()->request.switches.expected_power = true;
    both.back()->request.switches.multipath = true;
    both.back()->ping_from({}, {0, -0.25, 0});
  }
  const Sounding &with = *both[0], &plain = *both[1];
  int close = 0, all = 0;
  for (int n = static_cast<int>(with.row_of_range(4.5)); n < static_cast<int>(with.row_of_range(9.5)); ++n)
    for (int j = 4; j < 44; ++j, ++all) {
      const double seen = with.power(n, j), expected = plain.power(n, j);
      ASSERT_GT(expected, 0);
      close += std::abs(10 * std::log10(seen / expected)) < 1;
    }
  EXPECT_GT(close, 0.99 * all);  // 0.95 if rays hit equal phases
}

TEST(MultipathCells, BothDirectionsOfAPathHaveTheSameSpeckle) {
  // A narrow strip straight ahead under a still surface. Both directions of a pair come from the same bearing and add in
  // amplitude, for any speckle of the cells. Expected power must equal the mean over many draws (a sum of powers would be 1.8
  // dB less).
  SceneMaker maker;
  maker.add(sheet(40, 40), silent_db).add(sheet(3, 0.04), -15, {6.5, 0, -1.35}, quat_from_rpy({0, -0.1, 0}));
  PingSettings settings = native_rows(9, 0.0254);
  settings.beam_count = 127;
  Sounding s(with_mirrors(maker, 1), silent(without_elevation_pattern(p900())), settings);
  s.request.sonar_in_world.position_m = {0, 0, -0.8};
  s.request.switches.multipath = true;
  const auto received = [&] { return s.ping(), energy(s, 5, 8.6, 60, 67); };
  s.request.switches.expected_power = true;
  const double expected = received();
  s.request.switches.multipath = false;
  EXPECT_GT(expected, 3 * received());
  s.request.switches.multipath = true;
  s.request.switches.expected_power = false;
  double mean = 0;
  constexpr int draws = 20;
  for (int draw = 0; draw < draws; ++draw) {
    s.request.seed = Seed{static_cast<std::uint64_t>(draw) + 1};
    mean += received() / draws;
  }
  record_oracle(no_number, "coherent pairs of ghosts, mean over speckle against expected power", 0,
                10 * std::log10(mean / expected), 0.3, "dB");
}

/// Returns six smooth walls and two objects.
std::shared_ptr<const Scene> tank() {
  SceneMaker maker;
  maker.add(make_box({6, 5, 3}, 5), -25).add(sphere(0.3, 4), -20, {1.5, 0.4, 0.2}).add(box({0.2, 0.3, 0.4}), -20, {1, -1, -0.6});
  auto scene = with_mirrors(maker, 1, 0.7f);
  scene->materials[0].roughness_m = 5e-5f;
  return scene;
}

TEST(MultipathCells, SameBytesForAnyNumberOfThreads) {
  std::vector<std::byte> samples[2];
  std::vector<float> pressure[2];
  for (const int threads : {1, 2}) {
    Sounding s(tank(), p900(), default_rows(8, 120), {.threads = threads, .engine = {}});
    s.request.switches.multipath = true;
    s.request.switches.noise = true;
    s.ping_from({-2, 0.3, 0.1});
    const Ping& again = s.ping();
    samples[threads - 1] = again.samples;
    pressure[threads - 1] = again.pressure_upa;
  }
  EXPECT_EQ(samples[0], samples[1]);
  EXPECT_EQ(pressure[0], pressure[1]);
}

TEST(MultipathCells, ATankRingsOnBehindItsWalls) {
  Sounding on(tank(), p900(), default_rows(12, 200)), off(tank(), p900(), default_rows(12, 200));
  on.request.switches.multipath = true;
  for (Sounding* s : {&on, &off}) s->ping_from({-2, 0.3, 0.1});
  // Beyond the farthest corner, 6.1 m away, all echoes are reflected by the walls.
  EXPECT_EQ(energy(off, 7, 11.5, 0, 512), 0);
  EXPECT_GT(energy(on, 7, 11.5, 0, 512), 1e-4 * energy(on, 2, 6, 0, 512));
  const double by_cones = energy(on, 2, 11.5, 0, 512);
  for (int n = 0; n < on.rows(); ++n)
    for (int j = 0; j < on.beams(); ++j) ASSERT_TRUE(std::isfinite(on.pressure(n, j)));
  on.request.switches.conical = false;  // flat beams sort the same echoes in another way
  on.ping();
  EXPECT_NEAR(10 * std::log10(energy(on, 2, 11.5, 0, 512) / by_cones), 0, 1);
}

TEST(MultipathCells, PulsesByWayOfTheSpectrumGiveTheSameEchoes) {
  if (!spectral::have_transform) GTEST_SKIP() << "built without FFTW";
  SceneMaker maker;
  maker.add(sheet(40, 40), silent_db).add(sphere(0.2, 4), -20, {5, 0.5, -1.2});
  Sounding s(with_mirrors(maker, 1), p900(), default_rows(8, 120));
  s.request.sonar_in_world.position_m = {0, 0, -0.8};
  s.request.switches.multipath = true;
  const std::vector<float> in_time = s.ping().pressure_upa;
  auto model = std::make_shared<SonarModel>(*s.request.model);
  model->modes[0].waveform.exact = true;
  model->modes[0].name += " exact";
  s.request.model = model;
  const std::vector<float> by_spectrum = s.ping().pressure_upa;
  double wrong = 0, whole = 0;
  for (std::size_t i = 0; i < in_time.size(); ++i) {
    wrong += std::pow(static_cast<double>(by_spectrum[i] - in_time[i]), 2);
    whole += std::pow(static_cast<double>(in_time[i]), 2);
  }
  EXPECT_GT(whole, 0);
  EXPECT_LT(std::sqrt(wrong / whole), 1e-3);
}

TEST(MultipathCells, MovingMirrorsAreFoundWhereTheyAre) {
  // The wall is a moving body. Its ghosts move with it.
  SceneMaker maker;
  maker.add_body(sheet(20, 20), silent_db, {{0, 3, 0}, quat_from_rpy({pi / 2, 0, 0})}).add_point({8, 1, 0}, -20);
  Sounding s(with_mirrors(maker, 1), p900(), native_rows(12, 0.0254));
  s.request.switches.multipath = true;
  for (const double wall_y : {3.0, 2.2}) {
    s.request.bodies_in_world = {{{0, wall_y, 0}, quat_from_rpy({pi / 2, 0, 0})}};
    s.ping();
    const double y = 2 * wall_y - 1, range = std::hypot(8, y);
    // In the beam towards the image, either only the way back is via the mirror or both ways are. The former is stronger.
    const double by_one = 0.5 * (range + std::hypot(8, 1));
    EXPECT_NEAR(s.loudest_row(s.beam_at(std::atan2(y, 8))), s.row_of_range(by_one), 1) << wall_y;
  }
}

std::vector<FlatFace> faces_of(Mesh mesh) {
  return find_flat_faces(*SceneMaker().add(std::move(mesh), -20, {3, -2, 1}, quat_from_rpy({0.3, 0.2, 1})).make(), 0.05).faces;
}

TEST(FlatFaces, SidesOfBoxesAndSheetsAreFaces) {
  const std::vector<FlatFace> box_faces = faces_of(make_box({2, 1, 0.5}, 0.3));
  ASSERT_EQ(box_faces.size(), 6u);
  EXPECT_NEAR(box_faces[0].area_m2, 2, 1e-4);
  EXPECT_NEAR(std::abs(box_faces[0].normal.z), 1, 1e-6);
  EXPECT_NEAR(std::abs(box_faces[0].offset_m), 0.25, 1e-5);
  EXPECT_NEAR(box_faces[5].area_m2, 0.5, 1e-4);
  EXPECT_EQ(faces_of(make_plane(100, 60, 1)).size(), 1u);
  const Mesh tilted = height_field(-3, 3, -3, 3, 0.1, [](double x, double y) { return 0.3712 * x - 0.1234 * y; });
  ASSERT_EQ(faces_of(tilted).size(), 1u);
  EXPECT_NEAR(faces_of(tilted)[0].area_m2, 36 * std::sqrt(1 + 0.3712 * 0.3712 + 0.1234 * 0.1234), 0.01);
}

TEST(FlatFaces, CurvedAndNarrowThingsHaveNone) {
  EXPECT_TRUE(faces_of(make_sphere(1, 64)).empty());
  EXPECT_TRUE(faces_of(height_field(-5, 5, -5, 5, 0.5, rough_relief(0.05, 32))).empty());
  EXPECT_TRUE(faces_of(make_box({4, 0.05, 0.05}, 1)).empty());
  EXPECT_EQ(faces_of(make_cylinder(1.17, 1.22, segments_for(1.17), Caps::bottom)).size(),
            1u);  // only the floor of a round tank is a face
}

TEST(FlatFaces, AWeaklyReflectingFaceIsNoMirror) {
  auto scene = std::make_shared<Scene>(*SceneMaker().add(make_box({2, 2, 2}, 1), -20).make());
  scene->materials[0].reflection = 0.04f;
  EXPECT_TRUE(find_flat_faces(*scene, 0.05).faces.empty());
}

}  // namespace
}  // namespace sonar::test
