// Makes small scenes for the oracles: flat and rough beds, walls, boxes, spheres, points.
#pragma once

#include <functional>
#include <memory>

#include "core/scene/scene.hpp"

namespace sonar::test {

/// Returns a height field z(x, y) over a rectangle, with two triangles per square of about `step_m`.
Mesh height_field(double x0, double x1, double y0, double y1, double step_m, const std::function<double(double, double)>& z);
/// Returns a two-sided wall in the plane x = 0.
Mesh wall(double half_width_m, double half_height_m);
/// Returns an axis-aligned box about the origin.
Mesh box(Vec3d half_size_m);
/// Returns a sphere about the origin: an octahedron halved `halvings` times, vertices on the sphere (8 * 4^halvings triangles).
Mesh sphere(double radius_m, int halvings);

/// A relief of `waves` plane waves with random directions, wavelengths (0.3 to 3 m) and slopes, and the given rms height. It is
/// the same in every run.
std::function<double(double, double)> rough_relief(double rms_height_m, int waves);

/// Builds scenes step by step. Every object has its own material.
class SceneMaker {
 public:
  SceneMaker& add(Mesh mesh, double lambert_db, Vec3d position_m = {}, Quatd orientation = {});
  SceneMaker& add_of(Mesh mesh, const Material& material, Vec3d position_m = {}, Quatd orientation = {});
  SceneMaker& add_body(Mesh mesh, double lambert_db, Pose in_world);  // the body becomes the next moving body
  SceneMaker& add_point(Vec3d position_m, double target_strength_db);
  std::shared_ptr<const Scene> make() const { return std::make_shared<const Scene>(scene_); }

 private:
  std::uint16_t add_material(Material material);
  Scene scene_;
};

}  // namespace sonar::test
