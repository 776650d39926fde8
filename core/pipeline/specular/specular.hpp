// Specular echoes: a smooth surface with a normal through the sonar reflects a part of the wave coherently (docs/acoustics.md,
// section 3, eq. 7). Such echoes are points, which are added to the beams at their exact direction.
#pragma once

#include <array>
#include <bitset>
#include <complex>
#include <memory>
#include <vector>

#include "core/pipeline/scatter.hpp"
#include "core/scene/specular/specular_mesh.hpp"
#include "core/scene/specular/specular_point.hpp"

namespace sonar {

// Computes how much of a mirror's echo reaches the sonar if the surface is finite and partly hidden: Fresnel integrals over the
// visible part (docs/acoustics.md, section 3).

/// Divides the surface into cells around the point that contributes most, to find hidden parts. The outermost cells reach to the
/// edge of the surface.
struct SpecularWindow {
  static constexpr std::size_t cells = 16;
  std::array<std::array<double, cells + 1>, 2> edge{};  // along the principal directions [m]
  std::bitset<cells * cells> hidden;                    // bit y * cells + x
};
SpecularWindow make_window(const SpecularPoint& point, double wavelength_m);

/// K_1 K_2 of eq. 7 with its phase: 1 for an infinite mirror, a factor i for each focus on the path (time convention e^{+i 2 pi
/// f t}).
std::complex<double> specular_factor(const SpecularPoint& point, double wavelength_m);
/// The same factor without the cells that are hidden.
std::complex<double> specular_factor(const SpecularPoint& point, double wavelength_m, const SpecularWindow& window);

/// True if a point in the tangent plane belongs to the surface.
bool on_surface(const SpecularPoint& point, double x, double y);
/// The point of the surface that is nearest to the foot of the perpendicular from the sonar.
std::array<double, 2> nearest_on_surface(const SpecularPoint& point);

/// Fraction of the pressure that a surface reflects coherently at normal incidence: reflection times exp(-2 k^2 h^2). It is 0 for
/// rough surfaces (smooth_below_kh) and for results below a hundredth.
double coherent_reflection(const Material& material, double wavelength_m);

/// Finds specular echoes. The meshes of visible objects are prepared when they are first used, and kept between pings.
class SpecularEchoes {
 public:
  /// Appends the specular echoes of the surfaces that rays find visible.
  void find(const PingContext& context, std::vector<PointEcho>& echoes);
  /// Drops meshes that no scene uses.
  void forget_unused();

 private:
  struct PreparedMesh {
    std::shared_ptr<const Mesh> mesh;
    std::vector<std::uint16_t> materials;  // materials of the mesh
    Vec3d centre_m;
    double radius_m = 0;
    /// The part of the mesh that reflects. It depends on the frequency. There is one for every set of reflecting materials, so
    /// that a ping does not depend on earlier pings.
    struct Surface {
      std::vector<bool> mirrors;  // by material
      std::unique_ptr<const SpecularMesh> mesh;
    };
    std::vector<Surface> surfaces;  // oldest first
  };
  PreparedMesh& prepared(std::size_t object, const std::shared_ptr<const Mesh>& mesh);
  void candidates(const Object& object, PreparedMesh& mesh, const SpecularQuery& query);

  std::vector<PreparedMesh> meshes_;  // in the order of their first use
  std::vector<std::size_t> mesh_of_;  // by object: index into meshes_
  std::vector<double> reflection_;    // per material, this ping
  std::vector<bool> mirrors_;         // materials of a mesh that reflect
  std::vector<SpecularPoint> points_;
};

}  // namespace sonar
