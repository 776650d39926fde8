// Compares labels of samples with geometry: the arc of a sphere, the visible part of a hidden object, the positions of shadows.
#include <gtest/gtest.h>

#include <cmath>
#include <ctime>

#include "core/pipeline/labels.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test::labels_test {
namespace {

/// Returns a scene of these objects. Each has a label except the first.
std::shared_ptr<const Scene> labelled(const SceneMaker& maker) {
  auto scene = std::make_shared<Scene>(*maker.make());
  for (std::size_t i = 1; i < scene->objects.size(); ++i) scene->objects[i].label = "thing";
  return scene;
}

Mesh flat_bed() {
  return height_field(-1, 16, -12, 12, 0.5, [](double, double) { return 0.0; });
}

constexpr double radius_m = 0.4, sphere_x_m = 6, height_m = 2;
constexpr double tilt_rad = 0.28;

std::shared_ptr<const Scene> sphere_on_sand() {
  return labelled(SceneMaker().add(flat_bed(), -27).add(sphere(radius_m, 5), -27, {sphere_x_m, 0, radius_m}));
}

struct Labelled {
  Labelled(std::shared_ptr<const Scene> of, int threads, double range_m = 11)
      : s(of, p900(), native_rows(range_m, 0.0254)), pool(threads), engine(make_cpu_engine(std::move(of), pool)) {
    s.request.sonar_in_world = {{0, 0, height_m}, quat_from_rpy({0, tilt_rad, 0})};
    s.request.switches.noise = s.request.switches.keep_labels = true;
  }
  const PingLabels& run() {
    pings = engine->run({&s.request, 1});
    return *pings.front().labels;
  }

  Sounding s;
  Parallel pool;
  std::unique_ptr<PingEngine> engine;
  std::vector<Ping> pings;
};

std::size_t count(const PingLabels& labels, std::uint16_t instance) {
  return static_cast<std::size_t>(std::count(labels.instance.begin(), labels.instance.end(), instance));
}

TEST(Labels, ThePingIsTheSameWithThem) {
  Labelled l(sphere_on_sand(), 2);
  l.run();
  l.s.request.switches.keep_labels = false;
  const Ping& plain = l.s.ping();
  EXPECT_FALSE(plain.labels);
  EXPECT_EQ(l.pings.front().samples, plain.samples);
  EXPECT_EQ(l.pings.front().pressure_upa, plain.pressure_upa);
}

TEST(Labels, ASphereOnSandIsTheArcThatGeometrySays) {
  Labelled l(sphere_on_sand(), 2);
  const PingLabels& labels = l.run();
  (void)l.s.ping();  // sets the bearings of the beams
  ASSERT_EQ(labels.rows, l.s.rows());
  // The front of the sphere, where the line of sight is normal to it, and the largest bearing of its edge.
  const double distance = std::hypot(sphere_x_m, height_m - radius_m);
  const double first_m = distance - radius_m, limb_m = std::sqrt(distance * distance - radius_m * radius_m);
  const double half_sine = radius_m / distance;
  const auto beams = static_cast<std::size_t>(labels.beams);
  int first_row = labels.rows, last_row = 0, first_beam = labels.beams, last_beam = 0;
  for (int row = 0; row < labels.rows; ++row)
    for (int j = 0; j < labels.beams; ++j) {
      const std::size_t at = static_cast<std::size_t>(row) * beams + static_cast<std::size_t>(j);
      if (labels.instance[at] != 2 || labels.share[at] < 128) continue;
      first_row = std::min(first_row, row), last_row = std::max(last_row, row);
      first_beam = std::min(first_beam, j), last_beam = std::max(last_beam, j);
    }
  // A strong sphere appears earlier than its front by half a pulse width, and half a beam width beside its edge.
  const double pulse_rows = 0.0254 / l.s.request.settings.range_bin_m;
  EXPECT_NEAR(first_row, l.s.row_of_range(first_m) - pulse_rows, pulse_rows + 1);
  EXPECT_LE(last_row, l.s.row_of_range(limb_m) + 2 * pulse_rows + 1);
  EXPECT_GE(last_row, l.s.row_of_range(first_m) + 1);
  const auto beam_of = [&](double sine) { return l.s.beam_at(std::asin(sine)); };
  const double beam_width = std::sin(rad_from_deg(1.0));
  EXPECT_LE(first_beam, beam_of(half_sine) + 3);
  EXPECT_GE(first_beam, beam_of(half_sine + beam_width) - 1);
  EXPECT_GE(last_beam, beam_of(-half_sine) - 3);
  EXPECT_LE(last_beam, beam_of(-half_sine - beam_width) + 1);
  EXPECT_GT(labels.visible[1], 0.9f);
  EXPECT_EQ(labels.visible[0], -1.0f);
}

TEST(Labels, TheShadowLiesBehindTheSphereAndNamesIt) {
  Labelled l(sphere_on_sand(), 2);
  const PingLabels& labels = l.run();
  const auto beams = static_cast<std::size_t>(labels.beams), middle = beams / 2;
  // The ray over the top of the sphere hits the bed behind it. It is the tangent from (0, height) to the circle in the plane y
  // = 0.
  const double distance = std::hypot(sphere_x_m, height_m - radius_m);
  const double down = std::atan2(height_m - radius_m, sphere_x_m) - std::asin(radius_m / distance);
  const double end_m = height_m / std::sin(down), limb_m = std::sqrt(distance * distance - radius_m * radius_m);
  const int from = static_cast<int>(l.s.row_of_range(limb_m + 0.1)), to = static_cast<int>(l.s.row_of_range(end_m));
  int in_shadow = 0;
  for (int row = from; row < to; ++row) in_shadow += labels.caster[static_cast<std::size_t>(row) * beams + middle] == 2 ? 1 : 0;
  EXPECT_GT(in_shadow, 0.85 * (to - from));
  const auto after = static_cast<std::size_t>(to + 6) * beams + middle;
  EXPECT_EQ(labels.instance[after], 1);
}

/// A sphere in front of a box, on sand. The expected object is the first that a straight line from the sonar to a point of the
/// bed hits.
struct SphereBeforeBox {
  static constexpr double box_x_m = 8, box_half_m[3] = {0.2, 1.5, 0.6};

  std::shared_ptr<const Scene> scene() const {
    return labelled(SceneMaker()
                        .add(flat_bed(), -27)
                        .add(sphere(radius_m, 5), -27, {sphere_x_m, 0, radius_m})
                        .add(box({box_half_m[0], box_half_m[1], box_half_m[2]}), -27, {box_x_m, 0, box_half_m[2]}));
  }
  static bool meets_sphere(Vec3d from, Vec3d to) {
    const Vec3d way = to - from, away = from - Vec3d{sphere_x_m, 0, radius_m};
    const double b = dot(way, away), a = dot(way, way);
    return b * b > a * (dot(away, away) - radius_m * radius_m);
  }
  static bool meets_box(Vec3d from, Vec3d to) {
    double enters = 0, leaves = 1;
    const auto slab = [&](double begin, double step, double middle, double half) {
      const double a = (middle - half - begin) / step, b = (middle + half - begin) / step;
      enters = std::max(enters, std::min(a, b)), leaves = std::min(leaves, std::max(a, b));
    };
    slab(from.x, to.x - from.x, box_x_m, box_half_m[0]);
    if (to.y != from.y) slab(from.y, to.y - from.y, 0, box_half_m[1]);
    slab(from.z, to.z - from.z, box_half_m[2], box_half_m[2]);
    return enters < leaves;
  }
};

TEST(Labels, TheNearerOfTwoObjectsCastsTheShadow) {
  const SphereBeforeBox things;
  Labelled l(things.scene(), 2);
  const PingLabels& labels = l.run();
  (void)l.s.ping();
  const auto beams = static_cast<std::size_t>(labels.beams);
  const Vec3d sonar{0, 0, height_m};
  int of_both = 0, nearer = 0, of_box = 0, box = 0;
  for (int row = 0; row < labels.rows; ++row)
    for (std::size_t j = 0; j < beams; ++j) {
      const double range_m = l.s.request.settings.range_of_row(row);
      const double y = range_m * std::sin(static_cast<double>(l.pings.front().beam_azimuth_rad[j]));
      const double x_square = range_m * range_m - y * y - height_m * height_m;
      const std::uint16_t caster = labels.caster[static_cast<std::size_t>(row) * beams + j];
      if (caster == 0 || x_square <= SphereBeforeBox::box_x_m * SphereBeforeBox::box_x_m) continue;
      const Vec3d place{std::sqrt(x_square), y, 0};
      if (!things.meets_box(sonar, place)) continue;
      const bool both = things.meets_sphere(sonar, place);
      (both ? of_both : of_box) += 1;
      (both ? nearer : box) += caster == (both ? 2 : 3) ? 1 : 0;
    }
  std::printf("behind both: %d of %d name the sphere; behind the box alone: %d of %d the box\n", nearer, of_both, box, of_box);
  ASSERT_GT(of_both, 100);
  ASSERT_GT(of_box, 1000);
  EXPECT_GT(nearer, 0.9 * of_both);
  EXPECT_GT(box, 0.95 * of_box);
}

TEST(Labels, OpenWaterBehindASphereInMidWaterIsNoShadow) {
  constexpr double small_m = 0.1, sphere_m = 2, deep_m = 3.5;  // the bed is farther than the sphere in every direction
  const Vec3d middle{sphere_m * std::cos(tilt_rad), 0, height_m - sphere_m * std::sin(tilt_rad)};
  Labelled l(labelled(SceneMaker().add(flat_bed(), -27, {0, 0, height_m - deep_m}).add(sphere(small_m, 5), -27, middle)), 2, 17);
  const PingLabels& labels = l.run();
  const auto beams = static_cast<std::size_t>(labels.beams);
  const double half_rad = std::asin(small_m / sphere_m);
  const auto bed_at = [&](double down_rad) { return deep_m / std::sin(down_rad); };
  const auto in_shadow = [&](double from_m, double to_m) {
    const int from = static_cast<int>(l.s.row_of_range(from_m)), to = static_cast<int>(l.s.row_of_range(to_m));
    int n = 0;
    for (int row = from; row < to; ++row) n += labels.caster[static_cast<std::size_t>(row) * beams + beams / 2] == 2 ? 1 : 0;
    return static_cast<double>(n) / (to - from);
  };
  (void)l.s.ping();
  EXPECT_EQ(in_shadow(sphere_m + 0.1, bed_at(tilt_rad + half_rad) - 0.1), 0);
  EXPECT_GT(in_shadow(bed_at(tilt_rad + half_rad) + 0.1, bed_at(tilt_rad - half_rad)), 0.85);
}

TEST(Labels, InstancesNoneAndShadowTileTheSwath) {
  Labelled l(sphere_on_sand(), 2);
  const PingLabels& labels = l.run();
  for (std::size_t i = 0; i < labels.instance.size(); ++i) {
    ASSERT_FALSE(labels.instance[i] != 0 && labels.caster[i] != 0);
    ASSERT_TRUE(labels.instance[i] != 0 || labels.share[i] == 0);
    ASSERT_LE(std::max(labels.instance[i], labels.caster[i]), 2);
  }
  EXPECT_GT(count(labels, 1), labels.instance.size() / 4);
}

TEST(Labels, AnOccludedObjectHasNoSamples) {
  const auto scene = labelled(
      SceneMaker().add(flat_bed(), -27).add(box({0.05, 1.5, 1.4}), -20, {5, 0, 1.4}).add(sphere(0.2, 4), -10, {5.6, 0, 0.2}));
  Labelled l(scene, 2);
  const PingLabels& labels = l.run();
  EXPECT_GT(count(labels, 2), 500u);
  EXPECT_EQ(count(labels, 3), 0u);
  EXPECT_LT(labels.visible[2], 0.01f);
}

TEST(Labels, AreTheSameOnAnyNumberOfThreads) {
  Labelled one(sphere_on_sand(), 1), three(sphere_on_sand(), 3);
  const PingLabels &a = one.run(), &b = three.run();
  EXPECT_EQ(a.instance, b.instance);
  EXPECT_EQ(a.share, b.share);
  EXPECT_EQ(a.caster, b.caster);
  EXPECT_EQ(a.visible, b.visible);
}

TEST(Labels, APointTargetIsAnInstance) {
  auto scene = std::make_shared<Scene>(*SceneMaker().add(flat_bed(), -27).add_point({5, 0.5, 0.8}, 0).make());
  Labelled l(scene, 2);
  const PingLabels& labels = l.run();
  EXPECT_GT(count(labels, 2), 3u);
  EXPECT_EQ(labels.visible.at(1), 1.0f);
}

TEST(Labels, EchoesBelowTheNoiseThatChannelsShareHaveNone) {
  // The label share of a point at the edge of the sector. Near the sonar the noise is strong there.
  const auto share = [](float level_db) {
    FrequencyMode mode = p900();
    mode.receiver.shared_noise.level_db = level_db;
    auto scene = std::make_shared<Scene>(*SceneMaker().add_point({0.4, 0.24, 0}, -20).make());
    Sounding s(scene, mode, native_rows(2, 0.0254));
    s.request.switches.noise = s.request.switches.keep_labels = true;
    Parallel pool(1);
    const Ping ping = make_cpu_engine(scene, pool)->run({&s.request, 1}).front();
    return ping.labels ? *std::max_element(ping.labels->share.begin(), ping.labels->share.end()) : 0;
  };
  EXPECT_GT(share(-200), 200);
  EXPECT_LT(share(140), 20);
}

TEST(Labels, APointTargetThatIsSeenOverAShadowKeepsItsLabel) {
  const Vec3d place{7, 0, 1.0};
  Labelled l(
      labelled(SceneMaker().add(flat_bed(), -27).add(sphere(radius_m, 5), -27, {sphere_x_m, 0, radius_m}).add_point(place, 0)),
      2);
  const PingLabels& labels = l.run();
  (void)l.s.ping();
  const auto beams = static_cast<std::size_t>(labels.beams);
  const auto row = static_cast<std::size_t>(std::lround(l.s.row_of_range(std::hypot(place.x, height_m - place.z))));
  EXPECT_EQ(labels.instance[row * beams + beams / 2], 3);
  EXPECT_EQ(labels.caster[row * beams + beams / 2], 0);
  EXPECT_EQ(labels.caster[(row - 10) * beams + beams / 2], 2);
}

TEST(Labels, TheFixedFanHasNone) {
  Labelled l(sphere_on_sand(), 1);
  l.s.request.switches.fixed_fan = 100;
  EXPECT_NE(why_unlabelled(l.s.request, *sphere_on_sand()), "");
  EXPECT_FALSE(l.engine->run({&l.s.request, 1}).front().labels);
}

TEST(Labels, CostLessThanTwoAndAHalfPings) {
  Labelled l(sphere_on_sand(), 1);
  double without_s = HUGE_VAL, with_s = HUGE_VAL;
  const auto time = [&](bool labels, double& fastest_s) {
    l.s.request.switches.keep_labels = labels;
    const std::clock_t begin = std::clock();  // processor time of this process, so that other programs have no influence
    (void)l.engine->run({&l.s.request, 1});
    fastest_s = std::min(fastest_s, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  };
  for (int i = 0; i < 30; ++i) time(false, without_s), time(true, with_s);
  RecordProperty("ratio", std::to_string(with_s / without_s));
  std::printf("a ping %.1f ms, with labels %.1f ms: %.2f times\n", 1e3 * without_s, 1e3 * with_s, with_s / without_s);
  EXPECT_LT(with_s, 2.5 * without_s);
}

}  // namespace
}  // namespace sonar::test::labels_test
