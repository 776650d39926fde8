#include "cuda/flat_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/scene/extent.hpp"

namespace sonar::cuda {
namespace {

// Surface-area rule: the probability that a ray hits a box is proportional to its area. Therefore the cost of a part is its
// area times its number of triangles.
constexpr int bins = 16;
constexpr std::size_t most_in_leaf = 4;
constexpr int deepest_by_area = 32;  // deeper nodes split their items into two equal numbers, in at most 32 more levels

void grow(Box& box, const Box& by) {
  for (int k = 0; k < 3; ++k) {
    box.low[k] = std::min(box.low[k], by.low[k]);
    box.high[k] = std::max(box.high[k], by.high[k]);
  }
}
/// Half the area of a box; 0 for no_box.
float half_area(const Box& b) {
  const float x = b.high[0] - b.low[0], y = b.high[1] - b.low[1], z = b.high[2] - b.low[2];
  return x < 0 ? 0 : x * y + y * z + z * x;
}
/// Twice the centre. The factor does not matter, because only comparisons and ratios of differences are used.
float twice_centre(const Box& b, int axis) { return b.low[axis] + b.high[axis]; }

struct Split {
  int axis = -1, bin = 0;
  float cost = huge_distance;
};

class Builder {
 public:
  Builder(std::span<const Box> items, std::vector<BvhNode>& nodes, std::vector<std::uint32_t>& order)
      : items_(items), nodes_(nodes), order_(order), index_(items.size()) {
    std::iota(index_.begin(), index_.end(), 0u);
  }

  std::int32_t run() {
    const auto root = static_cast<std::int32_t>(nodes_.size());
    if (index_.size() <= most_in_leaf) {  // the root must be a node; a single leaf becomes its child
      nodes_.push_back({});
      const Box all = bounds(0, index_.size());
      set_child(root, 0, all, index_.empty() ? 0 : leaf(0, index_.size()));
      set_child(root, 1, no_box, 0);
      if (index_.empty()) set_child(root, 0, no_box, 0);
      return root;
    }
    return split(0, index_.size(), 0);
  }

 private:
  Box bounds(std::size_t from, std::size_t to) const {
    Box box = no_box;
    for (std::size_t i = from; i < to; ++i) grow(box, items_[index_[i]]);
    return box;
  }
  void set_child(std::int32_t node, int side, const Box& box, std::int32_t link) {
    BvhNode& n = nodes_[static_cast<std::size_t>(node)];
    std::copy(box.low, box.low + 3, n.low[side]);
    std::copy(box.high, box.high + 3, n.high[side]);
    n.link[side] = link;
  }
  std::int32_t leaf(std::size_t from, std::size_t to) {
    const auto first = static_cast<std::uint32_t>(order_.size());
    for (std::size_t i = from; i < to; ++i) order_.push_back(index_[i]);
    return bvh_link({first, static_cast<std::uint32_t>(to - from)});
  }

  /// Splits [from, to), which has too many items for a leaf. Returns the new node.
  std::int32_t split(std::size_t from, std::size_t to, int depth) {
    const auto node = static_cast<std::int32_t>(nodes_.size());
    nodes_.push_back({});
    // Halving by number limits the depth, and therefore the stack of a ray (build_bvh).
    const std::size_t middle = depth < deepest_by_area ? divide(from, to) : halve(from, to);
    const std::size_t ends[3] = {from, middle, to};
    for (int side = 0; side < 2; ++side) {
      const std::size_t a = ends[side], b = ends[side + 1];
      const Box box = bounds(a, b);
      const std::int32_t link = b - a <= most_in_leaf ? leaf(a, b) : split(a, b, depth + 1);
      set_child(node, side, box, link);
    }
    return node;
  }

  std::size_t halve(std::size_t from, std::size_t to) const { return from + (to - from) / 2; }

  /// Splits at the cheapest of the planes between bins. If all centres are equal, splits by number.
  std::size_t divide(std::size_t from, std::size_t to) {
    Box centres = no_box;
    for (std::size_t i = from; i < to; ++i)
      for (int k = 0; k < 3; ++k) {
        const float c = twice_centre(items_[index_[i]], k);
        centres.low[k] = std::min(centres.low[k], c);
        centres.high[k] = std::max(centres.high[k], c);
      }
    Split best;
    for (int axis = 0; axis < 3; ++axis) consider(from, to, centres, axis, best);
    if (best.axis < 0) return halve(from, to);
    const auto first = index_.begin() + static_cast<std::ptrdiff_t>(from),
               last = index_.begin() + static_cast<std::ptrdiff_t>(to);
    // The partition is stable, so that the order of triangles, and the choice between equal hits, is the same with every
    // compiler.
    const auto middle =
        std::stable_partition(first, last, [&](std::uint32_t i) { return bin_of(items_[i], centres, best.axis) <= best.bin; });
    return static_cast<std::size_t>(middle - index_.begin());
  }
  static int bin_of(const Box& item, const Box& centres, int axis) {
    const float part = (twice_centre(item, axis) - centres.low[axis]) / (centres.high[axis] - centres.low[axis]);
    return std::clamp(static_cast<int>(part * bins), 0, bins - 1);
  }
  void consider(std::size_t from, std::size_t to, const Box& centres, int axis, Split& best) const {
    // If all centres have the same coordinate on this axis, bin_of() would divide by 0.
    if (!(centres.high[axis] > centres.low[axis])) return;
    std::array<Box, bins> box;
    box.fill(no_box);
    std::array<std::size_t, bins> count{};
    for (std::size_t i = from; i < to; ++i) {
      const Box& item = items_[index_[i]];
      const auto b = static_cast<std::size_t>(bin_of(item, centres, axis));
      grow(box[b], item);
      ++count[b];
    }
    // First computes the cost of all bins above each plane, then that of all bins below it.
    std::array<float, bins> above{};
    Box all = no_box;
    std::size_t number = 0;
    for (std::size_t b = bins - 1; b > 0; --b) {
      grow(all, box[b]);
      number += count[b];
      above[b - 1] = number == 0 ? huge_distance : half_area(all) * static_cast<float>(number);
    }
    all = no_box;
    number = 0;
    for (std::size_t b = 0; b + 1 < bins; ++b) {
      grow(all, box[b]);
      number += count[b];
      // A plane without items below it does not divide them.
      if (number == 0) continue;
      const float cost = half_area(all) * static_cast<float>(number) + above[b];
      if (cost < best.cost) best = {axis, static_cast<int>(b), cost};
    }
  }

  std::span<const Box> items_;
  std::vector<BvhNode>& nodes_;
  std::vector<std::uint32_t>& order_;
  std::vector<std::uint32_t> index_;
};

}  // namespace

std::int32_t build_bvh(std::span<const Box> items, std::vector<BvhNode>& nodes, std::vector<std::uint32_t>& order) {
  return Builder(items, nodes, order).run();
}

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
  // Computed in double, then rounded to float [m]: relative to the origin of rays, or in the axes of a body.
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
    // A hit reports the numbers that the scene uses for the object and the triangle.
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

/// The box, in world axes, around a rotated body's own box. It is slightly larger than necessary, because rays are converted to
/// the body's axes in float.
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
    // 1 mm plus 1e-5 of the distance, far above the rounding error of float [m]. A ray that hits the body must also hit the box.
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
    // The triangles have the order of the leaves: a leaf is a range of the array.
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
