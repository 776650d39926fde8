// Tests that the device's rays have the same hits as Embree's: on relief and rotated bodies, along edges and past silhouettes.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/scene/ray_scene.hpp"
#include "cuda/flat_scene.hpp"
#include "cuda/trace_ray.hpp"
#include "tests/core/pipeline/scenes.hpp"

namespace sonar::cuda {
namespace {

using test::SceneMaker;

struct Tracers {
  explicit Tracers(std::shared_ptr<const Scene> scene) : embree(scene, 1), flat(*scene), places(flat.place({})) {}
  void place(const std::vector<Pose>& bodies) {
    embree.place(bodies);
    places = flat.place(bodies);
  }
  RayHit ours(const Ray& ray, float far_m) const { return trace_ray(host_view(flat, places), ray, far_m); }
  RayHit theirs(const Ray& ray, float far_m) const {
    RayPacket p{};
    p.origin_x[0] = ray.from[0], p.origin_y[0] = ray.from[1], p.origin_z[0] = ray.from[2];
    p.direction_x[0] = ray.along[0], p.direction_y[0] = ray.along[1], p.direction_z[0] = ray.along[2];
    p.far[0] = far_m;
    embree.trace(p, 1, false);
    return {p.far[0], p.object[0], p.triangle[0], {p.normal_x[0], p.normal_y[0], p.normal_z[0]}};
  }
  RayScene embree;
  FlatScene flat;
  BodyPlaces places;
};

Ray ray_to(Vec3d from, Vec3d at) {
  const Vec3 o = to_float(from), d = to_float((1 / length(at - from)) * (at - from));
  return {{o.x, o.y, o.z}, {d.x, d.y, d.z}};
}

struct Agreement {
  int rays = 0, hits = 0, other_object = 0;
  double worst_range = 0;
};
/// Compares 20,000 rays. They go from points near `middle` to points within `spread` of it.
Agreement compare(const Tracers& t, Vec3d middle, double spread, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(-1, 1);
  Agreement a;
  for (int i = 0; i < 20000; ++i) {
    const Vec3d from = middle + Vec3d{0.3 * spread * any(random), 0.3 * spread * any(random), 0.2 * spread * any(random)};
    const Vec3d to = middle + Vec3d{spread * any(random), spread * any(random), spread * any(random)};
    const Ray ray = ray_to(from, to);
    const RayHit ours = t.ours(ray, 30), theirs = t.theirs(ray, 30);
    ++a.rays;
    if (theirs.object != no_object) ++a.hits;
    if (ours.object != theirs.object) {
      ++a.other_object;
      continue;
    }
    if (ours.object == no_object) continue;
    a.worst_range = std::max(a.worst_range, std::abs(static_cast<double>(ours.range_m - theirs.range_m)));
  }
  return a;
}

TEST(DeviceRays, HitARoughBedWhereEmbreeDoes) {
  SceneMaker maker;
  maker.add(test::height_field(-10, 10, -10, 10, 0.2, test::rough_relief(0.3, 20)), -20, {3, 4, -6});
  maker.add(test::sphere(0.7, 4), -20, {4, 3, -5});
  maker.add(test::box({0.5, 0.2, 0.3}), -20, {2, 5, -4.8}, quat_from_rpy({0.3, 0.2, 0.5}));
  const Tracers t(maker.make());
  const Agreement a = compare(t, {0, 0, 2}, 6, 1);
  EXPECT_GT(a.hits, 6000);
  EXPECT_LE(a.other_object, 2);  // at silhouettes, one of 20,000 rays may pass an edge on the other side
  EXPECT_LT(a.worst_range, 2e-4);
  RecordProperty("other_object", a.other_object);
}

TEST(DeviceRays, HitBodiesAtAnyPlace) {
  SceneMaker maker;
  maker.add(test::height_field(-8, 8, -8, 8, 0.5, [](double, double) { return 0.0; }), -20, {0, 0, -3});
  for (int i = 0; i < 7; ++i) maker.add_body(test::sphere(0.6, 3), -20, {{i - 3.0, 1, -1}, {}});
  maker.add_body(test::box({1, 0.1, 0.4}), -20, {{0, -1, -1}, {}});
  Tracers t(maker.make());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int round = 0; round < 3; ++round) {
    std::vector<Pose> bodies;
    for (int i = 0; i < 8; ++i)
      bodies.push_back(
          {{3 * any(random), 3 * any(random), any(random) - 1}, quat_from_rpy({3 * any(random), any(random), 3 * any(random)})});
    t.place(bodies);
    const Agreement a = compare(t, t.flat.origin(), 4, 10u + static_cast<unsigned>(round));
    EXPECT_GT(a.hits, 4000);
    EXPECT_LE(a.other_object, 3);
    EXPECT_LT(a.worst_range, 2e-4);
  }
}

// The rays start inside a closed surface and go to points on its edges and corners. None may miss the surface.
TEST(DeviceRays, NeverSlipThroughAnEdge) {
  SceneMaker maker;
  const Mesh mesh = test::sphere(2, 4);
  maker.add(mesh, -20);
  const auto scene = maker.make();
  const FlatScene flat(*scene);
  const BodyPlaces places = flat.place({});
  const TracerView view = host_view(flat, places);
  const Vec3d from{0.1, -0.2, 0.05};
  int rays = 0, misses = 0;
  for (const auto& corners : mesh.triangles)
    for (int edge = 0; edge < 3; ++edge) {
      const Vec3d a = to_double(mesh.vertices[corners[static_cast<std::size_t>(edge)]]),
                  b = to_double(mesh.vertices[corners[static_cast<std::size_t>((edge + 1) % 3)]]);
      for (const double part : {0.0, 0.25, 0.5, 0.7071}) {
        ++rays;
        if (trace_ray(view, ray_to(from, a + part * (b - a)), 10).object == no_object) ++misses;
      }
    }
  EXPECT_GT(rays, 20000);
  EXPECT_EQ(misses, 0);
}

TEST(DeviceRays, HitNothingInAnEmptyScene) {
  const Scene empty;
  const FlatScene flat(empty);
  const BodyPlaces places = flat.place({});
  EXPECT_EQ(trace_ray(host_view(flat, places), ray_to({0, 0, 0}, {1, 0, 0}), 10).object, no_object);
}

TEST(DeviceRays, HitOneOrManyTrianglesInOnePlace) {
  SceneMaker maker;
  Mesh fan;
  fan.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  for (int i = 0; i < 300; ++i) fan.triangles.push_back({0, 1, 2});  // no plane separates them
  fan.material.assign(300, 0);
  maker.add(fan, -20);
  const auto scene = maker.make();
  const FlatScene flat(*scene);
  const BodyPlaces places = flat.place({});
  const Vec3d o = flat.origin();
  const RayHit hit = trace_ray(host_view(flat, places), ray_to(Vec3d{0.2, 0.2, 1} - o, Vec3d{0.2, 0.2, -1} - o), 10);
  EXPECT_EQ(hit.object, 0u);
  EXPECT_EQ(hit.triangle, 0u);  // the first of the triangles with the same range
  EXPECT_NEAR(hit.range_m, 1, 1e-6);
}

}  // namespace
}  // namespace sonar::cuda
