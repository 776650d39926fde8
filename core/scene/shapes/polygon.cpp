#include "core/scene/shapes/polygon.hpp"

#include <cmath>
#include <cstddef>

namespace sonar {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

struct Flat {
  double x, y;
};
double turn(Flat a, Flat b, Flat c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

// Projects the polygon along the axis nearest to its (Newell) normal. Its corners become counter-clockwise.
std::vector<Flat> flattened(std::span<const Vec3d> p) {
  Vec3d n;
  for (std::size_t i = 0; i < p.size(); ++i) n = n + cross(p[i] - p[0], p[(i + 1) % p.size()] - p[0]);
  std::vector<Flat> out;
  const double ax = std::abs(n.x), ay = std::abs(n.y), az = std::abs(n.z);
  for (const Vec3d& v : p) {
    if (az >= ax && az >= ay) {
      out.push_back(n.z > 0 ? Flat{v.x, v.y} : Flat{v.y, v.x});
    } else if (ay >= ax) {
      out.push_back(n.y > 0 ? Flat{v.z, v.x} : Flat{v.x, v.z});
    } else {
      out.push_back(n.x > 0 ? Flat{v.y, v.z} : Flat{v.z, v.y});
    }
  }
  return out;
}

bool is_ear(const std::vector<Flat>& p, const std::vector<std::uint32_t>& left, std::size_t i) {
  const std::size_t n = left.size();
  const Flat a = p[left[(i + n - 1) % n]], b = p[left[i]], c = p[left[(i + 1) % n]];
  if (!(turn(a, b, c) > 0)) return false;
  for (std::size_t k = 2; k + 1 < n; ++k) {
    const Flat q = p[left[(i + k) % n]];
    if (turn(a, b, q) >= 0 && turn(b, c, q) >= 0 && turn(c, a, q) >= 0) return false;
  }
  return true;
}

}  // namespace

std::vector<Triangle> triangulate(std::span<const Vec3d> corners) {
  std::vector<Triangle> out;
  if (corners.size() < 3) return out;
  std::vector<std::uint32_t> left(corners.size());
  for (std::uint32_t i = 0; i < left.size(); ++i) left[i] = i;
  if (corners.size() > 3 && corners.size() <= 512) {
    const std::vector<Flat> flat = flattened(corners);
    for (bool found = true; found && left.size() > 3;) {
      found = false;
      for (std::size_t i = 0; i < left.size() && !found; ++i) {
        if (!is_ear(flat, left, i)) continue;
        const std::size_t n = left.size();
        out.push_back({left[(i + n - 1) % n], left[i], left[(i + 1) % n]});
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(i));
        found = true;
      }
    }
  }
  for (std::size_t i = 1; i + 1 < left.size(); ++i) out.push_back({left[0], left[i], left[i + 1]});
  return out;
}

}  // namespace sonar
