// The whole CPU pipeline with analytic rays: closed forms of the tracer, and pings that are equal for any number of threads.
// Linked with analytic_rays.cpp instead of Embree. tests/tools/long_checks.sh runs it with the thread sanitizer.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>

#include "core/base/parallel.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "core/scene/files/load_scene.hpp"
#include "core/scene/ray_scene.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test {
namespace {

std::shared_ptr<const Scene> scene_of(const char* yaml) {
  auto scene = parse_scene(yaml, "analytic", {});
  if (!scene) throw std::runtime_error(scene.error().text);
  return *scene;
}

constexpr const char* shapes_yaml = R"(
objects:
  - {name: bed, type: plane, material: sand, size_m: [6, 4], pose: {xyz_m: [3, 0, -2]}}
  - {name: crate, type: box, material: concrete, size_m: [1, 2, 1], pose: {xyz_m: [5, 0, 0], rpy_deg: [0, 0, 90]}}
  - {name: ball, type: sphere, material: steel, radius_m: 0.5, moving: true, pose: {xyz_m: [3, 0.9, 0]}}
  - {name: pile, type: cylinder, material: concrete, radius_m: 0.25, length_m: 2, pose: {xyz_m: [3, -0.9, 0]}}
)";

struct Seen {
  std::string object;
  float far_m = 0;
  double cosine = 0;  // cosine of the angle to the normal
};
Seen look(const RayScene& rays, Vec3d direction) {
  RayPacket p{};
  const double size = length(direction);
  p.direction_x[3] = static_cast<float>(direction.x / size);
  p.direction_y[3] = static_cast<float>(direction.y / size);
  p.direction_z[3] = static_cast<float>(direction.z / size);
  p.far[3] = 100;
  rays.trace(p, 1u << 3, false);
  if (p.object[3] == RayPacket::miss) return {};
  const Vec3d normal{p.normal_x[3], p.normal_y[3], p.normal_z[3]};
  return {rays.scene().objects[p.object[3]].name, p.far[3], std::abs(dot(normal, direction)) / (length(normal) * size)};
}

TEST(AnalyticRays, HitShapesAtTheirPlace) {
  RayScene rays(scene_of(shapes_yaml), 1);
  EXPECT_EQ(RayScene::version(), "analytic rays") << "linked with another tracer";
  const Seen crate = look(rays, {1, 0, 0}), ball = look(rays, {3, 0.9, 0}), pile = look(rays, {3, -0.9, 0}),
             bed = look(rays, {1, 0, -1});
  EXPECT_EQ(crate.object, "crate");
  EXPECT_NEAR(crate.far_m, 4, 1e-5) << "turned by 90 degrees: 2 m long ahead";
  EXPECT_NEAR(crate.cosine, 1, 1e-6);
  EXPECT_EQ(ball.object, "ball");
  EXPECT_NEAR(ball.far_m, std::hypot(3, 0.9) - 0.5, 1e-5);
  EXPECT_NEAR(ball.cosine, 1, 1e-6);
  EXPECT_EQ(pile.object, "pile");
  EXPECT_NEAR(pile.far_m, std::hypot(3, 0.9) - 0.25, 1e-5);
  EXPECT_EQ(bed.object, "bed");
  EXPECT_NEAR(bed.far_m, 2 * std::sqrt(2.0), 1e-5);
  EXPECT_NEAR(bed.cosine, std::sqrt(0.5), 1e-6);
  EXPECT_EQ(look(rays, {-1, 0, 0}).object, "");

  const Pose moved{{2, 0, 0}, {}};
  rays.place({&moved, 1});
  EXPECT_EQ(look(rays, {1, 0, 0}).object, "ball");
  EXPECT_NEAR(look(rays, {1, 0, 0}).far_m, 1.5, 1e-5);
}

PingRequest request(std::uint32_t number) {
  PingRequest r;
  auto model = std::make_shared<SonarModel>();
  model->name = "test";
  model->modes = {p900()};
  r.model = std::move(model);
  r.number = PingNumber{number};
  r.fired_at = Time(std::chrono::milliseconds(100 * number));
  r.seed = Seed{7};
  r.sonar_moves = {{0.5, 0, 0}, {0, 0, 0.2}};
  r.bodies_in_world = {{{3, 0.9 - 0.05 * number, 0}, {}}};
  r.settings = default_rows(6, 120);
  r.settings.beam_count = 64;
  r.switches.multipath = true;
  r.switches.keep_pressure = true;
  return r;
}

TEST(AnalyticRays, PingsAreTheSameForAnyNumberOfThreads) {
  const auto scene = scene_of(shapes_yaml);
  Parallel alone(1), crew(4);
  const auto one = make_cpu_engine(scene, alone), four = make_cpu_engine(scene, crew);
  for (std::uint32_t number = 1; number <= 3; ++number) {
    const PingRequest r = request(number);
    const Ping a = one->run({&r, 1}).at(0), b = four->run({&r, 1}).at(0);
    EXPECT_TRUE(a.samples == b.samples) << "ping " << number;
    EXPECT_EQ(0, std::memcmp(a.pressure_upa.data(), b.pressure_upa.data(), a.pressure_upa.size() * sizeof(float)));
    // The near side of the box, 4 m ahead, is among the strongest echoes of the middle beam.
    const auto at = [&](int row) { return a.pressure_upa[static_cast<std::size_t>(row * 64 + 32)]; };
    float before = 0, there = 0;
    for (int row = 66; row < 72; ++row) before = std::max(before, at(row));  // 3.3 to 3.6 m: water
    for (int row = 77; row < 83; ++row) there = std::max(there, at(row));    // 3.85 to 4.15 m
    EXPECT_GT(there, 3 * before) << "ping " << number;
  }
}

}  // namespace
}  // namespace sonar::test
