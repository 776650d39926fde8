// Compares the fast ray caster with the simple one: triangle soups, moving bodies, distant positions, and empty scenes.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "core/base/memory_left.hpp"
#include "core/scene/ray_scene.hpp"
#include "tests/core/held_variable.hpp"
#include "tests/core/scene/scene_testing.hpp"
#include "tests/memory_limit.hpp"

namespace sonar {
namespace {

using tests::brute_force;
using tests::Draw;
using tests::Hit;
using tests::set_ray;
using tests::soup;

// Casts `packets` packets from points around the origin and checks every lane.
void compare(const Scene& scene, const RayScene& rays, std::span<const Pose> bodies, Draw& draw, int packets, double far_m,
             bool coherent, double tolerance_m) {
  int hits = 0;
  for (int n = 0; n < packets; ++n) {
    RayPacket packet{};
    Vec3d from[16], along[16];
    for (int i = 0; i < 16; ++i) {
      const Vec3 rounded = to_float(draw.point(6));  // both sides get the position as float
      from[i] = rays.origin() + to_double(rounded);
      const Vec3d d = draw.point(1);
      along[i] = to_double(to_float((1 / length(d)) * d));
      set_ray(packet, i, to_double(rounded), along[i], far_m);
    }
    const std::uint32_t active = n % 3 == 0 ? 0x5A5Au : 0xFFFFu;
    rays.trace(packet, active, coherent);
    for (int i = 0; i < 16; ++i) {
      if (!((active >> i) & 1)) {
        EXPECT_EQ(packet.object[i], RayPacket::miss);
        EXPECT_EQ(packet.far[i], static_cast<float>(far_m));
        continue;
      }
      const Hit truth = brute_force(scene, bodies, from[i], along[i], far_m);
      ASSERT_EQ(packet.object[i], truth.object) << "packet " << n << " lane " << i << " at " << truth.distance_m;
      if (truth.object == RayPacket::miss) {
        EXPECT_EQ(packet.far[i], static_cast<float>(far_m));
        EXPECT_EQ(packet.normal_x[i], 0);
        EXPECT_EQ(packet.normal_y[i], 0);
        EXPECT_EQ(packet.normal_z[i], 0);
        continue;
      }
      ++hits;
      EXPECT_EQ(packet.triangle[i], truth.triangle);
      EXPECT_NEAR(packet.far[i], truth.distance_m, tolerance_m);
      const Vec3d normal{packet.normal_x[i], packet.normal_y[i], packet.normal_z[i]};
      const double cosine = dot(normal, truth.normal) / (length(normal) * length(truth.normal));
      EXPECT_NEAR(std::abs(cosine), 1, 1e-5);
    }
  }
  EXPECT_GT(hits, packets);
}

std::shared_ptr<Scene> three_soups(Draw& draw, Vec3d centre) {
  auto scene = std::make_shared<Scene>();
  scene->materials.emplace_back();
  for (int i = 0; i < 3; ++i) {
    scene->objects.push_back(
        Object{.name = "soup", .mesh = soup(draw, 150, 5, 1), .in_world = {centre + draw.point(2), draw.turn()}});
  }
  return scene;
}

TEST(RayScene, AgreesWithBruteForceOnStaticScenes) {
  Draw draw(1);
  const auto scene = three_soups(draw, {});
  const RayScene rays(scene, 2);
  compare(*scene, rays, {}, draw, 60, 30, true, 1e-4);
  compare(*scene, rays, {}, draw, 60, 30, false, 1e-4);
}

TEST(RayScene, FarIsTheLongestDistanceOfInterest) {
  Draw draw(2);
  const auto scene = three_soups(draw, {});
  const RayScene rays(scene, 1);
  compare(*scene, rays, {}, draw, 60, 2.5, true, 1e-4);
}

TEST(RayScene, StaysExactTwoKilometresAway) {
  Draw draw(3);
  const Vec3d far_place{2000, -2000, -500};
  const auto scene = three_soups(draw, far_place);
  const RayScene rays(scene, 1);
  EXPECT_LT(length(rays.origin() - far_place), 5);
  compare(*scene, rays, {}, draw, 60, 30, true, 1e-4);
}

TEST(RayScene, InvisibleObjectsAreNotThere) {
  Draw draw(4);
  auto scene = three_soups(draw, {});
  scene->objects[1].visible = false;
  const RayScene rays(scene, 1);
  compare(*scene, rays, {}, draw, 60, 30, true, 1e-4);
}

TEST(RayScene, AnotherSceneIsTracedAsANewOne) {
  Draw draw(14);
  std::vector<std::shared_ptr<const Scene>> scenes;
  const auto ground = soup(draw, 900, 5, 1), stone = soup(draw, 60, 3, 1);
  for (int i = 0; i < 9; ++i) {  // more scenes than are kept at once, with a common part
    auto scene = three_soups(draw, {});
    if (i % 3 != 0) scene->objects[1] = Object{.name = "ground", .mesh = ground, .in_world = {{2, 0, 0}, {}}};
    scene->objects.push_back(Object{.name = "stone", .mesh = stone, .in_world = {{0, 0.1 * i, 0}, {}}});
    scene->objects.push_back(Object{.name = "also", .mesh = stone, .in_world = {{4, 1, 0}, {}}, .visible = i % 2 == 0});
    scene->ray_origin = Vec3d{0.5 * (i % 2), 0, 0};
    scenes.push_back(scene);
  }
  RayScene rays(scenes[0], 1);
  for (const std::size_t s : {1u, 2u, 1u, 0u, 3u, 4u, 5u, 6u, 7u, 8u, 1u, 0u, 0u}) {
    rays.change(scenes[s]);
    EXPECT_EQ(&rays.scene(), scenes[s].get());
    compare(*scenes[s], rays, {}, draw, 20, 30, true, 1e-4);
  }
}

// Two bodies, one of them with two objects, beside a static object, far from the world's origin.
class MovingScene : public ::testing::Test {
 protected:
  MovingScene() {
    scene_ = three_soups(draw_, far_);
    for (int b = 0; b < 2; ++b) {
      scene_->body_names.push_back("body");
      scene_->bodies_in_world.push_back({far_ + draw_.point(2), draw_.turn()});
    }
    scene_->objects[1].body = 1;
    scene_->objects[2].body = 0;
    scene_->objects.push_back(Object{.name = "also", .mesh = soup(draw_, 60, 3, 1), .in_world = {far_, draw_.turn()}, .body = 1});
  }
  Draw draw_{5};
  Vec3d far_{1500, 1200, -30};
  std::shared_ptr<Scene> scene_;
};

TEST_F(MovingScene, ComesAndGoesWithScenesThatStandStill) {
  const auto still = three_soups(draw_, far_);
  RayScene rays(still, 1);
  rays.change(scene_);
  compare(*scene_, rays, scene_->bodies_in_world, draw_, 30, 30, true, 2e-4);
  rays.change(still);
  compare(*still, rays, {}, draw_, 30, 30, true, 2e-4);
}

TEST_F(MovingScene, StartsWhereTheSceneFilePutIt) {
  const RayScene rays(scene_, 2);
  compare(*scene_, rays, scene_->bodies_in_world, draw_, 60, 30, true, 2e-4);
}

TEST_F(MovingScene, FollowsItsPosesAndComesBack) {
  RayScene rays(scene_, 2);
  for (int step = 0; step < 4; ++step) {
    std::vector<Pose> bodies;
    for (int b = 0; b < 2; ++b) bodies.push_back({far_ + draw_.point(3), draw_.turn()});
    rays.place(bodies);
    compare(*scene_, rays, bodies, draw_, 30, 30, step % 2 == 0, 2e-4);
    rays.place(bodies);  // nothing moved
    compare(*scene_, rays, bodies, draw_, 10, 30, true, 2e-4);
  }
  rays.place({});
  compare(*scene_, rays, scene_->bodies_in_world, draw_, 30, 30, true, 2e-4);
}

TEST_F(MovingScene, AWorldOfBodiesAloneWorks) {
  scene_->objects.erase(scene_->objects.begin());
  const RayScene rays(scene_, 1);
  compare(*scene_, rays, scene_->bodies_in_world, draw_, 60, 30, true, 2e-4);
}

TEST(RayScene, AnEmptySceneMissesEverywhere) {
  for (const int bodies : {0, 1}) {
    auto scene = std::make_shared<Scene>();
    scene->bodies_in_world.resize(static_cast<std::size_t>(bodies));
    RayScene rays(scene, 1);
    rays.place(std::vector<Pose>(static_cast<std::size_t>(bodies), Pose{{1, 2, 3}, {}}));
    RayPacket packet{};
    for (int i = 0; i < 16; ++i) set_ray(packet, i, {}, {1, 0, 0}, 50);
    rays.trace(packet, 0xFFFF, true);
    for (int i = 0; i < 16; ++i) {
      EXPECT_EQ(packet.object[i], RayPacket::miss);
      EXPECT_EQ(packet.far[i], 50);
    }
  }
}

// Embree may trace 4, 8 or 16 rays together. The number depends on the processor.
class TracerWidth : public ::testing::TestWithParam<const char*> {
 protected:
  // The width for which Embree has code: that of its instruction set limit, and that of this processor.
  static int expected() {
    const std::string isa = GetParam();
#if defined(__x86_64__)
    if (isa == "avx512" && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl"))
      return 16;
    if (isa.starts_with("avx") && __builtin_cpu_supports("avx")) return 8;
#endif
    return 4;
  }
  tests::HeldVariable isa_{"SONARD_EMBREE_ISA", GetParam()};
};

TEST_P(TracerWidth, AgreesWithBruteForce) {
  Draw draw(7);
  const auto scene = three_soups(draw, {});
  const RayScene rays(scene, 1);
  EXPECT_EQ(rays.rays_at_once(), expected());
  compare(*scene, rays, {}, draw, 60, 30, true, 1e-4);
  compare(*scene, rays, {}, draw, 60, 30, false, 1e-4);
}

// Inactive lanes contain arbitrary bytes of the caller: rays of an earlier packet, zeros, or NaN.
TEST_P(TracerWidth, LanesThatAreNotActiveAreNotRead) {
  Draw draw(8);
  const auto scene = three_soups(draw, {});
  const RayScene rays(scene, 1);
  for (int n = 0; n < 200; ++n) {
    RayPacket given{};
    for (int i = 0; i < 16; ++i) {
      const Vec3d d = draw.point(1);
      set_ray(given, i, draw.point(4), (1 / length(d)) * d, 30);
    }
    RayPacket all = given;
    rays.trace(all, 0xFFFF, true);
    const std::uint32_t active = n < 16 ? 1u << n : static_cast<std::uint32_t>(draw(0, 65536));
    RayPacket some = given;
    for (int i = 0; i < 16; ++i) {
      if ((active >> i) & 1) continue;
      const float left =
          std::array{std::numeric_limits<float>::quiet_NaN(), HUGE_VALF, 0.0f, -1e30f}[static_cast<std::size_t>(n) % 4];
      some.origin_x[i] = some.origin_y[i] = some.origin_z[i] = left;
      some.direction_x[i] = some.direction_y[i] = some.direction_z[i] = left;
      some.far[i] = 5, some.triangle[i] = 77, some.normal_x[i] = 3;
    }
    rays.trace(some, active, true);
    for (int i = 0; i < 16; ++i) {
      if ((active >> i) & 1) {
        ASSERT_EQ(some.object[i], all.object[i]) << "packet " << n << " lane " << i;
        EXPECT_EQ(some.far[i], all.far[i]);
        EXPECT_EQ(some.triangle[i], all.triangle[i]);
        EXPECT_EQ(some.normal_x[i], all.normal_x[i]);
      } else {
        EXPECT_EQ(some.object[i], RayPacket::miss);
        EXPECT_EQ(some.far[i], 5);
        EXPECT_EQ(some.triangle[i], 77u);
        EXPECT_EQ(some.normal_x[i], 3);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Isa, TracerWidth, ::testing::Values("sse2", "sse4.2", "avx", "avx2", "avx512"), [](const auto& about) {
  std::string name = about.param;
  std::erase(name, '.');
  return name;
});

TEST(RayScene, RefusesAnUnknownInstructionSet) {
  const tests::HeldVariable isa("SONARD_EMBREE_ISA", "avx3");
  try {
    const RayScene rays(std::make_shared<Scene>(), 1);
    ADD_FAILURE() << "accepted";
  } catch (const std::runtime_error& e) {
    EXPECT_STREQ(e.what(), "SONARD_EMBREE_ISA: unknown instruction set \"avx3\"; use sse2, sse4.2, avx, avx2 or avx512");
  }
}

// Embree's cache of tessellated surfaces, which no scene has, would take 128 MB.
TEST(RayScene, ASmallSceneFitsIntoFewAddresses) {
  if (!test::memory_is_limited()) GTEST_SKIP() << "sanitizers and emulated processors keep no limit of addresses";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto build = [] {
    ::alarm(60);
    Draw draw(1);
    const auto scene = std::make_shared<Scene>();
    scene->objects.push_back(Object{.name = "soup", .mesh = soup(draw, 150, 5, 1), .in_world = {}});
    const rlim_t bytes = address_space_bytes().value() + (std::uint64_t{64} << 20);
    const rlimit limit{bytes, bytes};
    if (::setrlimit(RLIMIT_AS, &limit) != 0) ::_exit(2);
    const RayScene rays(scene, 1);
    ::_exit(0);
  };
  EXPECT_EXIT(build(), testing::ExitedWithCode(0), "");
}

TEST(RayScene, NamesItsLibrary) { EXPECT_EQ(RayScene::version().rfind("Embree ", 0), 0u); }

}  // namespace
}  // namespace sonar
