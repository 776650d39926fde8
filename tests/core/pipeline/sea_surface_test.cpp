// The sea surface from below: a rough sheet, or a mirror if it is still, and the bubbles under it (docs/acoustics.md, section
// 3).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/paper/paper_engine.hpp"
#include "core/pipeline/bubbles.hpp"
#include "core/pipeline/multipath/multipath_paths.hpp"
#include "core/pipeline/scattering_law.hpp"
#include "core/scene/files/load_scene.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

using ::testing::HasSubstr;

Result<std::shared_ptr<const Scene>> read(const std::string& keys) {
  return parse_scene(keys + "\nobjects: []\n", "s.yaml", ".");
}
std::shared_ptr<const Scene> sea(const std::string& keys) {
  const auto scene = read("sea_surface: {" + keys + "}");
  if (!scene) throw std::runtime_error(scene.error().text);
  return *scene;
}
std::string refusal(const std::string& keys) {
  const auto scene = read(keys);
  return scene ? "accepted" : scene.error().text;
}

TEST(SeaSurface, KeysReachTheSceneAndItsMaterial) {
  const auto scene = sea("lambert_db: -18, roughness_m: 0.2, bubble_layer_m: 0.5, bubble_loss_db_per_m: 3, size_m: [40, 60]");
  EXPECT_FLOAT_EQ(scene->sea_surface.lambert_db, -18);
  EXPECT_FLOAT_EQ(scene->sea_surface.roughness_m, 0.2f);
  EXPECT_FLOAT_EQ(scene->sea_surface.bubble_layer_m, 0.5f);
  EXPECT_FLOAT_EQ(scene->sea_surface.bubble_loss_db_per_m, 3);
  EXPECT_FLOAT_EQ(scene->materials.at(0).roughness_m, 0.2f);
  EXPECT_FLOAT_EQ(scene->materials.at(0).reflection, -1);
  EXPECT_EQ(scene->objects.at(0).primitive.kind, Primitive::Kind::plane);
  EXPECT_EQ(scene->objects.at(0).primitive.size_m.y, 60);
  EXPECT_FALSE((*read(""))->sea_surface.present);
  EXPECT_THAT(refusal("sea_surface: {roughness_m: -1}"), HasSubstr("sea_surface.roughness_m"));
  EXPECT_THAT(refusal("sea_surface: {bubble_loss_db_per_m: 3}"),
              HasSubstr("sea_surface: bubble_loss_db_per_m needs bubble_layer_m"));
}

TEST(SeaSurface, WaterColumnHasPresetsAndANumber) {
  EXPECT_FALSE((*read(""))->water_column.has_volume());
  EXPECT_EQ((*read("water_column: {clarity: clear}"))->water_column.volume_db, -80);
  EXPECT_EQ((*read("water_column: {clarity: turbid}"))->water_column.volume_db, -60);
  EXPECT_EQ((*read("water_column: {volume_db: -66}"))->water_column.volume_db, -66);
  EXPECT_THAT(refusal("water_column: {volume_db: -66, clarity: clear}"),
              HasSubstr("water_column.clarity: give clarity or volume_db, not both"));
  EXPECT_THAT(refusal("water_column: {clarity: murky}"), HasSubstr("turbid"));
  EXPECT_THAT(refusal("water_column: {volume_db: 3}"), HasSubstr("water_column.volume_db"));
  EXPECT_THAT(refusal("water_column: {volume: -60}"), HasSubstr("volume_db"));
}

TEST(SeaSurface, ARougherSurfaceMirrorsLessAndScattersMore) {
  double last = -1;
  for (const char* roughness : {"0", "0.00005", "0.0001", "0.0002", "0.01", "0.3"}) {
    const Material m = sea(std::string("roughness_m: ") + roughness)->materials.at(0);
    const double straight_up = scattering_strength(m, 1, 900e3, 1500, true);
    EXPECT_GE(straight_up, last) << roughness;
    last = straight_up;
  }
  EXPECT_EQ(scattering_strength(sea("roughness_m: 0")->materials.at(0), 0.7, 900e3, 1500, true), 0)
      << "still water mirrors only, and scatters nothing back";
  EXPECT_NEAR(last, std::pow(10.0, -3.0), 1e-9);
}

/// Depth and pitch of a sonar that looks up to the surface.
constexpr double depth_m = 2, nose_up_rad = 0.25;

TEST(SeaSurface, DiffuseEchoIsMuSquareSine) {
  for (const double lambert_db : {-35.0, -15.0}) {
    Sounding s(sea("lambert_db: " + std::to_string(lambert_db)), without_elevation_pattern(p900()), native_rows(10, 0.0254));
    s.request.switches.expected_power = true;
    s.request.switches.specular = true;
    s.ping_from({0, 0, -depth_m}, {0, -nose_up_rad, 0});
    // The mirror image of a seabed: same height, opposite tilt.
    const reference::SeabedLevel from_above(s.mode(), s.medium(), s.envelope_hz(), lambert_db, depth_m, nose_up_rad);
    for (double r = 4.2; r < 9.5; r += 0.5) {
      double sum = 0;
      int n = 0;
      for (int row = static_cast<int>(s.row_of_range(r)); row < s.row_of_range(r + 0.25); ++row)
        for (int j = 240; j < 272; ++j, ++n)
          sum += s.power(row, j) / power_from_db(from_above.db(s.range_of_row(row), s.beam_sine(j)));
      record_oracle(8, "sea surface from below", 0, 10 * std::log10(sum / n), 0.3, "dB");
    }
  }
}

// The middle of a tile that extends through a mirror may lie where no path via this mirror leads. The factor must still be a
// number.
TEST(Bubbles, TheFactorIsBetweenZeroAndOneBehindTheMirror) {
  const std::vector<FlatMirror> mirrors{{.face = 0, .normal = {0, 0, -1}, .height_m = 1, .reflection = -1}};
  const BubbleLayer bubbles(SeaSurface{.present = true, .bubble_layer_m = 0.5f, .bubble_loss_db_per_m = 4});
  PingScalars s;
  s.seen_from.position_m.z = -1;
  const auto factor = [&](double z) { return bubble_factor(bubbles, path_by(mirrors, 0), mirrors, {3, 0, z}, s); };
  for (const double z : {-2.0, 0.0, 0.999, 1.0, 1.5, 2.0, 2.5, 40.0}) {
    EXPECT_GT(factor(z), 0) << z;
    EXPECT_LT(factor(z), 1) << z;
  }
}

TEST(SeaSurface, BubblesTakeTheirShareOfThePath) {
  SeaSurface surface{.present = true, .bubble_layer_m = 0.5f, .bubble_loss_db_per_m = 4};
  const BubbleLayer layer(surface);
  const auto loss_db = [&](double from, double to, double path) { return -20 * std::log10(layer.two_way(from, to, path)); };
  EXPECT_NEAR(loss_db(-2, 0, 8), 2 * 4 * 8 * 0.25, 1e-6);
  EXPECT_NEAR(loss_db(-2, -0.25, 7), 2 * 4 * 7 * 0.25 / 1.75, 1e-6);
  EXPECT_NEAR(loss_db(-2, -5, 7), 0, 1e-9);
  EXPECT_NEAR(loss_db(-0.2, -0.2, 3), 2 * 4 * 3, 1e-6);
  EXPECT_NEAR(loss_db(-0.25, -5, 9.5), 2 * 4 * 0.5, 1e-6);
  EXPECT_FALSE(BubbleLayer(SeaSurface{}).present());
  surface.present = false;
  EXPECT_FALSE(BubbleLayer(surface).present());

  // In the picture: a quarter of a path from 2 m depth lies in the layer.
  Sounding calm(sea("lambert_db: -15"), p900(), default_rows(10, 394));
  Sounding bubbly(sea("lambert_db: -15, bubble_layer_m: 0.5, bubble_loss_db_per_m: 4"), p900(), default_rows(10, 394));
  for (Sounding* s : {&calm, &bubbly}) {
    s->request.switches.expected_power = true;
    s->ping_from({0, 0, -depth_m}, {0, -nose_up_rad, 0});
  }
  for (const double r : {5.0, 7.0, 9.0}) {
    double with = 0, without = 0;
    for (int row = static_cast<int>(calm.row_of_range(r)) - 3; row < calm.row_of_range(r) + 3; ++row)
      for (int j = 240; j < 272; ++j) with += bubbly.power(row, j), without += calm.power(row, j);
    record_oracle(no_number, "bubbles under the sea surface, loss there and back", 2 * 4 * 0.25 * r,
                  10 * std::log10(without / with), 0.3, "dB");
  }
}

/// Sea over a bed at 3 m, seen from this height.
struct OverABed {
  Sounding sounding;
  explicit OverABed(const std::string& surface = "sea_surface: {size_m: [60, 60]}\n")
      : sounding(scene(surface), p900(), default_rows(10, 394)) {
    sounding.request.switches.noise = true;
  }
  static std::shared_ptr<const Scene> scene(const std::string& surface) {
    auto scene = parse_scene(surface +
                                 "materials: {sand: {lambert_db: -20}}\n"
                                 "objects: [{type: plane, material: sand, size_m: [60, 60], pose: {xyz_m: [0, 0, -3]}}]\n",
                             "s.yaml", ".");
    if (!scene) throw std::runtime_error(scene.error().text);
    return *scene;
  }
  const Ping& from(double z_m, double climbs_mps = 0) {
    sounding.request.sonar_moves.velocity_mps.z = climbs_mps;
    return sounding.ping_from({0, 0, z_m}, {0, 0.35, 0});
  }
};

TEST(SeaSurface, ASonarAtTheSurfaceReceivesTheSameAsJustBelow) {
  OverABed bed;
  const auto below = bed.from(-0.001).samples;
  for (const double z : {0.0, -1e-9, 5e-4, 0.001}) {
    const Ping& ping = bed.from(z);
    EXPECT_EQ(ping.samples, below) << z;
    EXPECT_EQ(ping.request.sonar_in_world.position_m.z, z) << "the ping states the requested position";
    EXPECT_FALSE(ping.request.blank);
  }
  double at_it = 0, deeper = 0;
  for (int pass = 0; pass < 2; ++pass) {
    bed.from(pass == 0 ? 0.0 : -0.02);
    for (int row = bed.sounding.rows() / 2; row < bed.sounding.rows(); ++row)
      for (int j = 200; j < 312; ++j) (pass == 0 ? at_it : deeper) += bed.sounding.power(row, j);
  }
  EXPECT_NEAR(10 * std::log10(at_it / deeper), 0, 0.5) << "the bed";
}

TEST(SeaSurface, ASonarAboveTheSurfaceReceivesNoise) {
  OverABed bed, without("");
  const Ping& in_air = bed.from(0.0011);
  EXPECT_TRUE(in_air.request.blank) << "the ping is marked blank, so that its encoder can report it";
  const auto noise = in_air.samples;
  bed.sounding.request.blank = true;
  EXPECT_EQ(bed.from(-1).samples, noise);
  bed.sounding.request.blank = false;
  EXPECT_NE(bed.from(-1).samples, noise);
  EXPECT_FALSE(without.from(1).request.blank) << "without a sea surface z = 0 is a place like any other";
  EXPECT_NE(without.from(1).samples, noise);
}

TEST(SeaSurface, ASonarStaysInTheWaterDuringAPing) {
  OverABed bed;
  const auto at_rest = bed.from(-0.001).samples;
  EXPECT_EQ(bed.from(-0.001, 5).samples, at_rest) << "5 m/s for 6.7 ms would be 33 mm";
  EXPECT_EQ(bed.sounding.last().request.sonar_moves.velocity_mps.z, 5) << "the ping states the requested speed";
  EXPECT_NE(bed.from(-0.001, -5).samples, at_rest) << "a sonar may sink";
}

TEST(SeaSurface, TheComparisonModesSupportTheSurface) {
  auto scene = OverABed::scene("sea_surface: {size_m: [60, 60]}\n");
  Parallel pool(1);
  const auto engine = make_engine(scene, pool);
  PingRequest request = OverABed().sounding.request;
  request.switches.mode = Mode::paper;
  const auto samples_from = [&](double z_m) {
    request.sonar_in_world = {{0, 0, z_m}, quat_from_rpy({0, 0.35, 0})};
    return engine->run({&request, 1}).at(0).samples;
  };
  EXPECT_EQ(samples_from(0), samples_from(-0.001));
  EXPECT_NE(samples_from(0.5), samples_from(-0.001));
}

}  // namespace
}  // namespace sonar::test
