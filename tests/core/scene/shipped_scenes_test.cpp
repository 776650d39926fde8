// Every shipped scene loads, and agrees with docs/scenes.md.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <set>

#include "core/scene/files/load_scene.hpp"
#include "core/scene/ray_scene.hpp"
#include "tests/core/scene/scene_testing.hpp"

namespace sonar {
namespace {

std::shared_ptr<const Scene> shipped(const std::string& name) {
  auto scene = load_scene(std::filesystem::path(SONARD_SOURCE_DIR) / "scenes" / (name + ".yaml"));
  if (!scene) throw std::runtime_error(scene.error().text);
  return *scene;
}

// The object that a ray from `from` in direction azimuth, elevation hits, and its distance.
std::pair<std::string, float> look(const RayScene& rays, Vec3d from, double azimuth_deg, double elevation_deg) {
  const double a = rad_from_deg(azimuth_deg), e = rad_from_deg(elevation_deg);
  RayPacket packet{};
  for (int i = 0; i < 16; ++i) {
    tests::set_ray(packet, i, from - rays.origin(), {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)}, 100);
  }
  rays.trace(packet, 1, true);
  if (packet.object[0] == RayPacket::miss) return {"nothing", 0.0f};
  return {rays.scene().objects[packet.object[0]].name, packet.far[0]};
}

TEST(ShippedScenes, AllScenesLoadWithoutNotes) {
  for (const char* name : {"demo", "local-search", "tank-rod", "tank-two-cylinders", "l-targets"}) {
    const auto start = std::chrono::steady_clock::now();
    const auto scene = shipped(name);
    const std::chrono::duration<double, std::milli> load = std::chrono::steady_clock::now() - start;
    const RayScene rays(scene, 2);
    const std::chrono::duration<double, std::milli> both = std::chrono::steady_clock::now() - start;
    EXPECT_GT(scene->triangle_count(), 500u) << name;
    EXPECT_TRUE(scene->notes.empty()) << name;
    std::printf("%-20s %7zu triangles, %2zu objects, %zu materials, read in %.0f ms, built in %.0f ms\n", name,
                scene->triangle_count(), scene->objects.size(), scene->materials.size(), load.count(), (both - load).count());
  }
}

TEST(ShippedScenes, DemoStaysSmallAndHasTheListedObjects) {
  const auto scene = shipped("demo");
  EXPECT_EQ(scene->name, "harbour");
  EXPECT_LE(scene->triangle_count(), 150000u);
  EXPECT_TRUE(scene->body_names.empty());
  for (const char* wanted : {"bed", "pipe[0]", "wall[0]", "wreck", "drum", "boulder[0]", "quay"}) {
    EXPECT_EQ(1, std::count_if(scene->objects.begin(), scene->objects.end(), [&](const Object& o) { return o.name == wanted; }))
        << wanted;
  }
  const RayScene rays(scene, 2);
  const auto [below, depth] = look(rays, {7, 0, -3}, 0, -89);
  EXPECT_EQ(below, "bed");
  EXPECT_NEAR(depth, 2, 0.3);
  // The file of the wreck names its two materials.
  const auto wreck =
      std::find_if(scene->objects.begin(), scene->objects.end(), [](const Object& o) { return o.name == "wreck"; });
  std::set<std::string> names;
  for (const std::uint16_t m : wreck->mesh->material) names.insert(scene->materials[m].name);
  EXPECT_EQ(names, (std::set<std::string>{"steel", "wood"}));
}

TEST(ShippedScenes, LTargetsAreAtThePlacesOfTheTable) {
  const RayScene rays(shipped("l-targets"), 1);
  const auto expect = [&](double azimuth, double elevation, const char* name, double range) {
    const auto [object, distance] =
        look(rays, {}, azimuth, elevation + 0.1);  // off the equator, because an edge of the mesh lies there
    EXPECT_EQ(object, name) << azimuth << " " << elevation;
    if (range > 0) {
      EXPECT_NEAR(distance, range - 0.1, 4e-3);
    }
  };
  expect(20, 0, "A", 4);
  expect(-10, 0, "B", 4);
  expect(8, 0, "C", 7);
  expect(0, -25, "below", 5);
  for (const auto& [a, e] : {std::pair{-20.0, 0.0}, {10.0, 0.0}, {-8.0, 0.0}, {0.0, 25.0}, {0.0, 0.0}})
    expect(a, e, "nothing", 0);
}

TEST(ShippedScenes, TankRodFrontIsHalfAMetreAhead) {
  const auto scene = shipped("tank-rod");
  EXPECT_EQ(scene->body_names, std::vector<std::string>{"rod"});
  const RayScene rays(scene, 1);
  const auto [ahead, distance] = look(rays, {-0.4, 0, -0.61}, 0, 0);
  EXPECT_EQ(ahead, "rod");
  EXPECT_NEAR(distance, 0.5, 1e-3);
  EXPECT_NEAR(look(rays, {-0.4, 0, -0.61}, 180, 0).second, 1.1684 - 0.4, 2e-3);
  EXPECT_EQ(look(rays, {-0.4, 0, -0.61}, 0, 80).first, "nothing");  // the tank has no lid
}

TEST(ShippedScenes, TheTankHasTwoCylinders) {
  const RayScene rays(shipped("tank-two-cylinders"), 1);
  const Vec3d sonar{2.1, 1.0, -2.0};
  EXPECT_EQ(look(rays, sonar, 90, 0), (std::pair<std::string, float>{"standing", look(rays, sonar, 90, 0).second}));
  EXPECT_NEAR(look(rays, sonar, 90, 0).second, 3.4, 2e-3);
  EXPECT_EQ(look(rays, sonar, 90, -11.3).first, "lying");
  EXPECT_EQ(look(rays, sonar, 0, 0).first, "wall east");
  EXPECT_EQ(look(rays, sonar, 180, 0).first, "wall west");
  EXPECT_EQ(look(rays, sonar, 120, 0).first, "wall north");
  EXPECT_EQ(look(rays, sonar, -90, 0).first, "wall south");
  EXPECT_EQ(look(rays, sonar, 0, -89).first, "floor");
}

TEST(ShippedScenes, LocalSearchHasItsSizeAndPose) {
  const auto scene = shipped("local-search");
  EXPECT_NEAR(static_cast<double>(scene->triangle_count()), 200000, 10000);
  const RayScene rays(scene, 2);
  const auto [below, depth] = look(rays, {0, 0, -8}, 0, -89);
  EXPECT_EQ(below, "sand");
  EXPECT_NEAR(depth, 2, 0.2);
  const auto [ahead, distance] = look(rays, {0, 0, -8}, 0, deg_from_rad(std::atan2(-1.75, 6)));
  EXPECT_EQ(ahead, "sphere");
  EXPECT_NEAR(distance, 6.0, 0.05);
}

}  // namespace
}  // namespace sonar
