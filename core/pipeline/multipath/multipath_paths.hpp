// Paths between the sonar and another point: straight, or via one or two flat mirrors (docs/acoustics.md, section 3). In the
// image method a path is a straight line to the image of the target. Therefore a path is stored as a reflection of the sonar's
// axes.
#pragma once

#include <vector>

#include "core/pipeline/bubbles.hpp"
#include "core/pipeline/ping_context.hpp"
#include "core/scene/specular/flat_faces.hpp"

namespace sonar {

/// Largest number of mirrors in a ping. If there are more, the largest faces are used.
inline constexpr int most_mirrors = 16;
/// Mirrors with a smaller pressure reflectance, at the angle of incidence, are ignored.
inline constexpr double least_reflectance = 0.05;
/// A point, or the sonar, that is nearer to a mirror than this counts as lying in the mirror.
inline constexpr double touching_m = 1e-3;

/// A flat face in one ping, in the axes of PingScalars::seen_from: dot(normal, p) + height_m = 0 on its plane.
struct FlatMirror {
  int face = 0;  // index into FlatFaces::faces
  Vec3d normal;  // unit, towards the sonar
  double height_m = 0;
  double reflection = 0;
  double twice_kh_squared = 0;  // 2 (k h)^2, h = rms roughness

  /// Pressure reflectance at a cosine of incidence: Rc exp(-2 k^2 h^2 cos^2). It is the factor of specular echoes, for any
  /// incidence.
  double reflectance(double cosine) const { return reflection * std::exp(-twice_kh_squared * cosine * cosine); }
  double height_of(Vec3d p) const { return dot(normal, p) + height_m; }
};

/// One path out or back. The image of a point p is at turn * p + shift_m, in the direction in which the path leaves the sonar.
struct Path {
  int first = -1, second = -1;  // indices of mirrors in the order of the path out; -1 = none
  Rotation turn;                // improper for one bounce
  Vec3d shift_m;
  Vec3d second_normal;       // normal of the second mirror, as seen in the first
  bool beyond_front = true;  // true if the path leads to the side of the last mirror on which the sonar is

  Vec3d image_of(Vec3d p) const { return turn * p + shift_m; }
};

/// The mirrors of a ping, largest first.
std::vector<FlatMirror> mirrors_of(const PingContext& context, const FlatFaces& faces);

Path path_by(const std::vector<FlatMirror>& mirrors, int first, int second = -1);

/// Product of the reflectances for a path that leaves in this unit direction.
double reflectance_of(const Path& path, const std::vector<FlatMirror>& mirrors, Vec3d direction);
/// True if the path can reach a point from its last mirror: the point is on the lit side and not in the mirror.
bool is_lit(const Path& path, const std::vector<FlatMirror>& mirrors, Vec3d place);

/// Pressure factor of a layer of bubbles over all legs of one path to a point.
double bubble_factor(const BubbleLayer& bubbles, const Path& path, const std::vector<FlatMirror>& mirrors, Vec3d place,
                     const PingScalars& scalars);

}  // namespace sonar
