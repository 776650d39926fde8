// Finds the first surface that a ray hits: first in the hierarchy of fixed objects, then in those of the bodies on the ray's
// way. The code runs on host and device, for one ray at a time. Rounding cannot make a ray pass between two adjacent triangles.
#pragma once

#include <cmath>

#include "cuda/device_types.hpp"

namespace sonar::cuda {

struct Ray {
  float from[3], along[3];  // `along` of unit length
};
struct RayHit {
  float range_m = 0;
  std::uint32_t object = no_object, triangle = 0;
  Vec3 normal;  // geometric, world axes, any length, either side
};

/// Values of a ray that the descent needs, computed once. If a component of the direction is nearly 0, it becomes a tiny
/// number, so that all quotients are defined.
struct Descent {
  float from[3], per[3];
  int upper[3];  // 1 where the ray enters boxes by their high side
};
SONAR_HD inline Descent descent_of(const Ray& ray) {
  Descent d;
  for (int k = 0; k < 3; ++k) {
    const float a = ray.along[k], least = 1e-18f;
    const float safe = a < 0 ? (a > -least ? -least : a) : (a < least ? least : a);
    d.from[k] = ray.from[k];
    d.per[k] = 1.0f / safe;
    d.upper[k] = safe < 0 ? 1 : 0;
  }
  return d;
}

/// The range at which the ray enters a child's box; negative if it does not enter the box before `far_m`. The range at which it
/// leaves the box is increased by the rounding error of the quotients (Ize 2013). So flat boxes and shared sides are never
/// missed.
SONAR_HD inline float enters(const BvhNode& node, int side, const Descent& d, float far_m) {
  float in = 0, out = far_m;
  for (int k = 0; k < 3; ++k) {
    const float low = node.low[side][k], high = node.high[side][k];
    const float a = ((d.upper[k] ? high : low) - d.from[k]) * d.per[k];
    const float b = ((d.upper[k] ? low : high) - d.from[k]) * d.per[k];
    in = a > in ? a : in;
    out = b < out ? b : out;
  }
  return in <= out * 1.0000005f ? in : -1.0f;
}

/// Calls leaf(leaf, far_m) for the leaves on the ray's way, nearer ones first. The call may decrease far_m.
template <class Leaf>
SONAR_HD inline void descend(const BvhNode* nodes, std::int32_t root, const Descent& d, float& far_m, Leaf& leaf) {
  struct Waiting {
    std::int32_t link;
    float at_m;
  };
  Waiting stack[64];  // equals deepest_bvh
  int waiting = 0;
  std::int32_t link = root;
  for (;;) {
    if (is_leaf(link)) {
      leaf(bvh_leaf(link), far_m);
    } else {
      const BvhNode& node = nodes[link];
      const float a = enters(node, 0, d, far_m), b = enters(node, 1, d, far_m);
      if (a >= 0 && b >= 0) {
        const bool first = a <= b;
        stack[waiting].link = node.link[first ? 1 : 0];
        stack[waiting++].at_m = first ? b : a;
        link = node.link[first ? 0 : 1];
        continue;
      }
      if (a >= 0 || b >= 0) {
        link = node.link[a >= 0 ? 0 : 1];
        continue;
      }
    }
    do {
      if (waiting == 0) return;
      --waiting;
    } while (stack[waiting].at_m > far_m);
    link = stack[waiting].link;
  }
}

/// The side on which the ray passes the edge from `p` to `q`, both relative to the ray's origin. If the ends are exchanged,
/// only the sign changes. So a ray at the edge of two triangles hits one of them.
SONAR_HD inline float passes(Vec3 p, Vec3 q, Vec3 along) { return dot(cross(q - p, p + q), along); }

SONAR_HD inline float largest(Vec3 v) { return std::fmax(std::fabs(v.x), std::fmax(std::fabs(v.y), std::fabs(v.z))); }

struct TriangleTest {
  const FlatTriangle* triangles;
  Vec3 from, along;
  RayHit hit;

  SONAR_HD void operator()(BvhLeaf leaf, float& far_m) {
    for (std::uint32_t i = leaf.first; i < leaf.first + leaf.count; ++i) test(triangles[i], far_m);
  }
  SONAR_HD void test(const FlatTriangle& t, float& far_m) {
    const Vec3 a = Vec3{t.a[0], t.a[1], t.a[2]} - from, b = Vec3{t.b[0], t.b[1], t.b[2]} - from,
               c = Vec3{t.c[0], t.c[1], t.c[2]} - from;
    const float u = passes(a, b, along), v = passes(b, c, along), w = passes(c, a, along);
    const Vec3 ab = b - a, ac = c - a;
    // At a corner, rounding could make a ray miss all triangles that meet there. A tolerance of a few micrometres prevents
    // this.
    const float grace = 5e-7f * std::fabs(dot(a, along)) * (largest(ab) + largest(ac));
    if (!((u >= -grace && v >= -grace && w >= -grace) || (u <= grace && v <= grace && w <= grace))) return;
    const Vec3 normal = cross(ab, ac);
    const float speed = dot(normal, along);
    if (speed == 0) return;
    const float range_m = dot(normal, a) / speed;
    if (!(range_m >= 0 && range_m <= far_m)) return;
    // If two hits have exactly the same range, the choice between them does not depend on their order.
    if (range_m == hit.range_m && hit.object != no_object &&
        (t.object > hit.object || (t.object == hit.object && t.triangle >= hit.triangle)))
      return;
    far_m = range_m;
    hit.range_m = range_m;
    hit.object = t.object;
    hit.triangle = t.triangle;
    hit.normal = normal;
  }
};

struct BodyTest {
  const TracerView* tracer;
  const Ray* ray;
  RayHit hit;

  SONAR_HD void operator()(BvhLeaf leaf, float& far_m) {
    for (std::uint32_t i = leaf.first; i < leaf.first + leaf.count; ++i) test(tracer->bodies[i], far_m);
  }
  SONAR_HD void test(const PlacedBody& body, float& far_m) {
    const float* m = body.turn;
    const float p[3] = {ray->from[0] - body.position[0], ray->from[1] - body.position[1], ray->from[2] - body.position[2]};
    Ray own;
    for (int k = 0; k < 3; ++k) {
      own.from[k] = m[k] * p[0] + m[3 + k] * p[1] + m[6 + k] * p[2];
      own.along[k] = m[k] * ray->along[0] + m[3 + k] * ray->along[1] + m[6 + k] * ray->along[2];
    }
    TriangleTest test{tracer->triangles, {own.from[0], own.from[1], own.from[2]}, {own.along[0], own.along[1], own.along[2]}, {}};
    descend(tracer->nodes, body.root, descent_of(own), far_m, test);
    if (test.hit.object == no_object) return;
    hit = test.hit;
    const Vec3 n = test.hit.normal;  // in the body's axes
    hit.normal = {m[0] * n.x + m[1] * n.y + m[2] * n.z, m[3] * n.x + m[4] * n.y + m[5] * n.z,
                  m[6] * n.x + m[7] * n.y + m[8] * n.z};
  }
};

/// Returns the first hit before `far_m`; range_m of a miss is `far_m`.
SONAR_HD inline RayHit trace_ray(const TracerView& tracer, const Ray& ray, float far_m) {
  const Descent d = descent_of(ray);
  RayHit hit;
  if (tracer.has_still != 0) {
    TriangleTest still{tracer.triangles, {ray.from[0], ray.from[1], ray.from[2]}, {ray.along[0], ray.along[1], ray.along[2]}, {}};
    descend(tracer.nodes, tracer.still_root, d, far_m, still);
    hit = still.hit;
  }
  if (tracer.body_count > 0) {
    BodyTest moving{&tracer, &ray, hit};
    descend(tracer.top, 0, d, far_m, moving);
    hit = moving.hit;
  }
  hit.range_m = far_m;
  return hit;
}

}  // namespace sonar::cuda
