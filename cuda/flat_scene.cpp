#include "cuda/flat_scene.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "core/scene/extent.hpp"

namespace sonar::cuda {
namespace {

struct Bounds {
  Box box = no_box;
  void add(const float (&p)[3]) {
    for (int k = 0; k < 3; ++k) {
      box.low[k] = std::min(box.low[k], p[k]);
      box.high[k] = std::max(box.high[k], p[k]);
    }
  }
};

void add_object(const Mesh& mesh, const Pose& placed, std::uint32_t object, std::vector<FlatTriangle>& triangles) {
  // Computed in double up to the position, then in float relative to the origin of rays [m].
  const Rotation turn = rotation_from(placed.orientation);
  std::vector<std::array<float, 3>> corners;
  corners.reserve(mesh.vertices.size());
  for (const Vec3 vertex : mesh.vertices) {
    const Vec3 p = to_float(turn * to_double(vertex) + placed.position_m);
    corners.push_back({p.x, p.y, p.z});
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    FlatTriangle flat{};
    std::copy_n(corners[mesh.triangles[t][0]].begin(), 3, flat.a);
    std::copy_n(corners[mesh.triangles[t][1]].begin(), 3, flat.b);
    std::copy_n(corners[mesh.triangles[t][2]].begin(), 3, flat.c);
    // Object and triangle of a hit, with the numbers of the scene.
    flat.object = object;
    flat.triangle = static_cast<std::uint32_t>(t);
    triangles.push_back(flat);
  }
}

Box box_of(const FlatTriangle& t) {
  Bounds bounds;
  bounds.add(t.a);
  bounds.add(t.b);
  bounds.add(t.c);
  return bounds.box;
}

/// The box around a rotated body's box. It is slightly larger than necessary, because rays are converted to the body's axes in
/// float.
Box box_in_world(const Box& own, const PlacedBody& body) {
  Bounds bounds;
  for (int corner = 0; corner < 8; ++corner) {
    const float p[3] = {corner & 1 ? own.high[0] : own.low[0], corner & 2 ? own.high[1] : own.low[1],
                        corner & 4 ? own.high[2] : own.low[2]};
    float at[3];
    for (int k = 0; k < 3; ++k)
      at[k] = body.turn[3 * k] * p[0] + body.turn[3 * k + 1] * p[1] + body.turn[3 * k + 2] * p[2] + body.position[k];
    bounds.add(at);
  }
  for (int k = 0; k < 3; ++k) {
    // 1 mm plus the rounding error of float at that distance [m]. A ray that hits the body must also hit the box.
    const float slack = 1e-3f + 1e-5f * std::max(std::abs(bounds.box.low[k]), std::abs(bounds.box.high[k]));
    bounds.box.low[k] -= slack;
    bounds.box.high[k] += slack;
  }
  return bounds.box;
}

}  // namespace

FlatScene::FlatScene(const Scene& scene) : origin_(ray_origin_of(scene)), bodies_(scene.bodies_in_world) {
  // Group 0 contains the fixed objects in world axes. Group b + 1 contains body b in its own axes, so that a moved body needs
  // no new tree.
  std::vector<std::vector<FlatTriangle>> of_group(scene.bodies_in_world.size() + 1);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    if (!object.visible || object.mesh->triangles.empty()) continue;
    Pose placed = scene.in_body(object);
    if (object.body < 0) placed.position_m = placed.position_m - origin_;
    add_object(*object.mesh, placed, static_cast<std::uint32_t>(i), of_group[static_cast<std::size_t>(object.body + 1)]);
  }
  std::vector<std::uint32_t> order;
  for (const std::vector<FlatTriangle>& own : of_group) {
    Group group;
    group.has_triangles = !own.empty();
    std::vector<Box> boxes;
    boxes.reserve(own.size());
    for (const FlatTriangle& t : own) boxes.push_back(box_of(t));
    const std::size_t first = order.size();
    group.root = build_bvh(boxes, nodes_, order);
    // The order is that of the leaves: a leaf is a range of the array.
    for (std::size_t i = first; i < order.size(); ++i) triangles_.push_back(own[order[i]]);
    Bounds bounds;
    for (const Box& b : boxes) {
      bounds.add(b.low);
      bounds.add(b.high);
    }
    group.bounds = bounds.box;
    groups_.push_back(group);
  }
}

BodyPlaces FlatScene::place(std::span<const Pose> bodies_in_world) const {
  BodyPlaces places;
  std::vector<Box> boxes;
  std::vector<PlacedBody> bodies;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Group& group = groups_[b + 1];
    if (!group.has_triangles) continue;
    // Bodies without a pose in the request keep the pose of the scene.
    const Pose& pose = b < bodies_in_world.size() ? bodies_in_world[b] : bodies_[b];
    const Rotation turn = rotation_from(pose.orientation);
    const Vec3 at = to_float(pose.position_m - origin_);
    PlacedBody body{};
    for (int i = 0; i < 9; ++i) body.turn[i] = static_cast<float>(turn.m[i / 3][i % 3]);
    body.position[0] = at.x, body.position[1] = at.y, body.position[2] = at.z;
    body.root = group.root;
    boxes.push_back(box_in_world(group.bounds, body));
    bodies.push_back(body);
  }
  if (bodies.empty()) return places;
  std::vector<std::uint32_t> order;
  // A small tree over the bodies is made for every ping.
  build_bvh(boxes, places.top, order);
  for (const std::uint32_t i : order) places.bodies.push_back(bodies[i]);
  return places;
}

TracerView host_view(const FlatScene& scene, const BodyPlaces& places) {
  TracerView view;
  view.nodes = scene.nodes().data();
  view.triangles = scene.triangles().data();
  view.top = places.top.data();
  view.bodies = places.bodies.data();
  view.still_root = scene.still_root();
  view.has_still = scene.has_still() ? 1 : 0;
  view.body_count = static_cast<std::int32_t>(places.bodies.size());
  return view;
}

}  // namespace sonar::cuda
