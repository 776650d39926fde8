// Compares the device engine with the shipped CPU engine, which uses Embree. Rays are rounded differently in the last bit.
// At the edge of a shadow a cell may therefore be visible for only one of them. The test limits the number of such cells.
#include <gtest/gtest.h>

#include "tests/core/pipeline/basin.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/cuda/comparing.hpp"

namespace sonar::test {
namespace {

/// Makes a relief with a ball and a rotated body, which cast many shadows.
std::shared_ptr<const Scene> sea_bed() {
  SceneMaker maker;
  maker.add(height_field(-1, 12, -10, 10, 0.1, rough_relief(0.1, 30)), -25, {0, 0, -2});
  maker.add(sphere(0.5, 4), -15, {5, 0.7, -1.5});
  maker.add_body(box({0.4, 0.3, 0.3}), -15, {{4, -1, -1.4}, quat_from_rpy({0.1, 0.2, 0.7})});
  return maker.make();
}

PingRequest looking(double yaw_rad) {
  SonarModel model;
  model.name = "test";
  model.modes = {p900()};
  PingRequest r;
  r.model = std::make_shared<const SonarModel>(std::move(model));
  r.settings = default_rows(10, 394);
  r.settings.format = {.bits = 8, .max_code = 254, .gamma = 0.5f, .row_gains = false};
  r.settings.gain_db = 20;
  r.water = {.temperature_c = 10, .salinity_psu = 0, .ph = 8, .sound_speed_mps = 1480};
  r.sonar_in_world = {{0, 0, 0}, quat_from_rpy({0, 0.25, yaw_rad})};
  r.seed = Seed{3};
  r.switches.keep_pressure = r.switches.keep_beams = r.switches.keep_truth = true;
  return r;
}

TEST(DeviceEngineBesideEmbree, DiffersOnlyAtTheEdgesOfShadows) {
  SKIP_WITHOUT_A_MACHINE();
  BothEngines both(sea_bed());
  double worst = 0, all = 0;
  constexpr int pings = 8;
  for (int i = 0; i < pings; ++i) {
    const PingRequest r = looking(0.13 * i - 0.4);
    const Ping cpu = both.by_cpu(r), device = both.by_device(r);
    const Apart d = compare(cpu, device);
    ASSERT_TRUE(d.shape);
    const double echoes = static_cast<double>(both.cpu().statistics().echoes);
    const double other_echoes = static_cast<double>(both.device().statistics().echoes);
    // If the edge of a shadow moves by a sixteenth of an interval of the fan, only a few of a hundred thousand cells change.
    EXPECT_NEAR(other_echoes, echoes, 2e-3 * echoes) << i;
    EXPECT_LE(d.relative_l2, 0.05) << i;
    EXPECT_LE(d.samples_off, cpu.samples.size() / 50) << i;
    worst = std::max(worst, d.relative_l2);
    all += d.relative_l2;
    std::printf("%d: relative L2 %.1e, %zu of %zu samples off, by at most %u; echoes %+.0f of %.0f\n", i, d.relative_l2,
                d.samples_off, cpu.samples.size(), d.most_lsb, other_echoes - echoes, echoes);
  }
  RecordProperty("worst", std::to_string(worst));
  RecordProperty("mean", std::to_string(all / pings));
}

// Without an object that casts a shadow, the samples of both engines differ by 1 at most.
TEST(DeviceEngineBesideEmbree, IsTheSameWhereThereAreNoShadows) {
  SKIP_WITHOUT_A_MACHINE();
  SceneMaker maker;
  maker.add(height_field(-1, 12, -10, 10, 0.25, [](double x, double y) { return 0.02 * x + 0.01 * y; }), -25, {0, 0, -2});
  BothEngines both(maker.make());
  for (const double yaw : {-0.2, 0.3}) {
    const PingRequest r = looking(yaw);
    const Apart d = compare(both.by_cpu(r), both.by_device(r));
    EXPECT_LE(d.relative_l2, 1e-4);
    EXPECT_LE(d.most_lsb, 1u);
    EXPECT_TRUE(d.truth);
  }
}

}  // namespace
}  // namespace sonar::test
