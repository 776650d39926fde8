#include "core/pipeline/multipath/multipath_paths.hpp"

#include <algorithm>
#include <cmath>

namespace sonar {
namespace {

constexpr double most_grazing_cosine = 0.17;  // faces that do not reflect at a grazing angle of 10 degrees are ignored

/// Reflects positions: p - 2 (n . p + height) n.
struct Image {
  Rotation turn;
  Vec3d shift_m;
  Vec3d of(Vec3d p) const { return turn * p + shift_m; }
};
Image image_in(const FlatMirror& m) {
  const double n[3] = {m.normal.x, m.normal.y, m.normal.z};
  Image image;
  // The axes are reflected by the Householder matrix I - 2 n n^T; the plane's distance gives the shift.
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) image.turn.m[i][j] -= 2 * n[i] * n[j];
  image.shift_m = (-2 * m.height_m) * m.normal;
  return image;
}

const FlatMirror& at(const std::vector<FlatMirror>& mirrors, int i) { return mirrors[static_cast<std::size_t>(i)]; }

}  // namespace

std::vector<FlatMirror> mirrors_of(const PingContext& context, const FlatFaces& faces) {
  const Scene& scene = context.scene();
  const PingScalars& s = context.scalars;
  std::vector<FlatMirror> mirrors;
  // k = 2 pi f / c [rad/m].
  const double wave_number = 2 * pi * static_cast<double>(context.plan.mode.centre_hz) / s.sound_speed_mps;
  for (std::size_t f = 0; f < faces.faces.size() && static_cast<int>(mirrors.size()) < most_mirrors; ++f) {
    const FlatFace& face = faces.faces[f];
    const Material& material = scene.materials[static_cast<std::size_t>(face.material)];
    FlatMirror m;
    m.face = static_cast<int>(f);
    m.reflection = static_cast<double>(material.reflection);
    // Coherent reflectance Rc e^{-2 k^2 h^2 cos^2 a} of a face with rms roughness h (docs/acoustics.md, eq. 20).
    const double kh = wave_number * static_cast<double>(material.roughness_m);
    m.twice_kh_squared = 2 * kh * kh;
    if (std::abs(m.reflectance(most_grazing_cosine)) <= least_reflectance) continue;
    // The planes in the axes of seen_from [m]. The normal points towards the sonar, so heights are positive on the sonar's
    // side.
    const Pose in_sonar = compose(inverse(s.seen_from),
                                  scene.in_world(scene.objects[static_cast<std::size_t>(face.object)], context.bodies_in_world));
    m.normal = rotate(in_sonar.orientation, face.normal);
    m.height_m = -(face.offset_m + dot(m.normal, in_sonar.position_m));
    if (m.height_m < 0) m.normal = -1.0 * m.normal, m.height_m = -m.height_m;
    // If the sonar lies in the plane, it has no image. An image that is farther than the length of the record [m] has no echo.
    if (m.height_m < touching_m || m.height_m > 2 * s.max_range_m) continue;
    mirrors.push_back(m);
  }
  return mirrors;
}

Path path_by(const std::vector<FlatMirror>& mirrors, int first, int second) {
  Path path;
  path.first = first, path.second = second;
  if (first < 0) return path;
  const Image a = image_in(at(mirrors, first));
  path.turn = a.turn, path.shift_m = a.shift_m;
  if (second < 0) return path;
  const Image b = image_in(at(mirrors, second));
  // The reflection in the last mirror is applied first: a point is mirrored in b, then its image is mirrored in a.
  path.turn = a.turn * b.turn;
  path.shift_m = a.turn * b.shift_m + a.shift_m;
  path.second_normal = a.turn * at(mirrors, second).normal;
  path.beyond_front = at(mirrors, second).height_of(a.shift_m) > 0;  // a.shift_m is the sonar's own image in the first mirror
  return path;
}

double reflectance_of(const Path& path, const std::vector<FlatMirror>& mirrors, Vec3d direction) {
  if (path.first < 0) return 1;
  const double once = at(mirrors, path.first).reflectance(dot(at(mirrors, path.first).normal, direction));
  return path.second < 0 ? once : once * at(mirrors, path.second).reflectance(dot(path.second_normal, direction));
}

bool is_lit(const Path& path, const std::vector<FlatMirror>& mirrors, Vec3d place) {
  if (path.first < 0) return true;
  // The point must be on the lit side and at least touching_m from the mirror, because the mirror's own surface is not a
  // target.
  const double height = at(mirrors, path.second < 0 ? path.first : path.second).height_of(place);
  return (path.beyond_front ? height : -height) > touching_m;
}

double bubble_factor(const BubbleLayer& bubbles, const Path& path, const std::vector<FlatMirror>& mirrors, Vec3d place,
                     const PingScalars& s) {
  if (!bubbles.present()) return 1;
  // Goes backwards from the target point. Each mirror is crossed where the line from the sonar's last image to the target
  // crosses its plane.
  std::vector<Vec3d> bends{place};
  for (const int mirror : {path.second, path.first}) {
    if (mirror < 0) continue;
    const Vec3d end = bends.back();
    const bool two_left = mirror == path.second;
    const Vec3d source = two_left ? image_in(at(mirrors, path.second)).of(image_in(at(mirrors, path.first)).of({}))
                                  : image_in(at(mirrors, path.first)).of({});
    const double from = at(mirrors, mirror).height_of(source), to = at(mirrors, mirror).height_of(end);
    // A point on the dark side has no such line. The middle of a tile that extends through the mirror may be on the dark side.
    const double part = from == to ? 0.5 : std::clamp(from / (from - to), 0.0, 1.0);
    bends.push_back(source + part * (end - source));
  }
  bends.push_back({});
  double factor = 1;
  // World z [m], which determines whether a point is in the layer of eq. 16.
  const auto height = [&s](Vec3d p) { return s.seen_from.position_m.z + (s.world_from_sonar * p).z; };
  // two_way() is e^{-2 b l}. Its root is the loss of one way.
  for (std::size_t i = 0; i + 1 < bends.size(); ++i)
    factor *= std::sqrt(bubbles.two_way(height(bends[i]), height(bends[i + 1]), length(bends[i] - bends[i + 1])));
  return factor;
}

}  // namespace sonar
