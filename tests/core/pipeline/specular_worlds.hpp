// Scenes of one mirror and their expected echoes: the Kirchhoff integral summed patch by patch, without Fresnel integrals and
// principal radii.
#pragma once

#include <complex>
#include <functional>
#include <memory>
#include <vector>

#include "core/scene/scene.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test {

/// Returns a material that only reflects: it is smooth and has no diffuse echo.
Material mirror(double reflection = 1);

struct Mirror {
  Mesh mesh;
  Primitive primitive = {};
  Pose in_world = {};
  Material material = mirror();
};
/// Returns a scene of such objects. With `as_meshes` it has no primitives.
std::shared_ptr<const Scene> world_of(std::vector<Mirror> mirrors, bool as_meshes = false);

// Mirrors in their own axes, as mesh and as primitive.
Mirror specular_sphere(double radius_m);
Mirror specular_cylinder(double radius_m, double length_m);
Mirror specular_plane(double length_x_m, double length_y_m);
Mirror specular_box(Vec3d size_m);
/// Rotates the object so that its z axis (a plane's normal, a cylinder's axis) points along -x, and places it in front of the
/// sonar.
Pose facing(double x_m, double tilt_rad = 0);
/// Places the object with its z axis along world z, or tilted about x by `tilt_rad` towards y, at x_m ahead.
Pose standing(double x_m, double tilt_rad = 0);

/// Pings from the origin. Beam `beams / 2` looks along x; specular is on.
class SpecularSounding {
 public:
  SpecularSounding(std::shared_ptr<const Scene> scene, const FrequencyMode& mode, const PingSettings& settings);
  Sounding& sounding() { return sounding_; }
  /// Returns the amplitude of the strongest echo of the middle beam within `slack_m` of a range [uPa]; 0 without an echo.
  double peak_upa(double range_m, double slack_m = 0.05);
  /// Returns this amplitude as a pressure re the source at 1 m, without absorption: eq. 7 without exp(-2 alpha r).
  double strength_per_m(double range_m, double slack_m = 0.05);
  /// Turns the sonar by this much more to port.
  void turn(double yaw_rad);
  double wavelength_m() const;

 private:
  Sounding sounding_;
  double middle_azimuth_ = 0;
};

double db(double amplitude);
/// Echo of a rigid surface per source pressure at 1 m [1/m]: (1 / lambda) |integral of cos / R^2 exp(-i 2 k R) dA|. surface(u,
/// v), with u and v in (0, 1), returns the position and the area normal (its length is the area per du dv). The sonar is at the
/// origin. Points that the sonar sees from behind are ignored.
struct Patch {
  Vec3d place, area;
};
double kirchhoff_per_m(double wavelength_m, int steps_u, int steps_v, const std::function<Patch(double, double)>& surface);

}  // namespace sonar::test
