// Specular echoes: smooth surfaces whose normal passes through the sonar send back a part of the wave as a whole (eq. 7 of the
// model; docs/acoustics.md, section 3). Their echoes are points, added to the beams at their exact direction.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/ping_scalars.hpp"
#include "core/pipeline/scatter.hpp"
#include "core/scene/ray_scene.hpp"
#include "core/scene/specular/specular_mesh.hpp"
#include "core/scene/specular/specular_primitives.hpp"

namespace sonar {

/// Pressure reflected coherently at normal incidence: reflection times exp(-2 k^2 h^2), 0 for surfaces too rough to mirror
/// (smooth_below_kh) and where less than a hundredth is left.
double coherent_reflection(const Material& material, double wavelength_m);

/// Values kept between pings: every mesh with smooth materials, prepared when it is first in view.
class SpecularEchoes {
 public:
  /// Appends the specular echoes of the scene's surfaces, as far as rays find them in sight.
  void find(const PingContext& context, std::vector<PointEcho>& echoes);
  /// Forgets meshes that no scene has any more.
  void forget_unused();

 private:
  struct PreparedMesh {
    std::shared_ptr<const Mesh> mesh;
    std::vector<std::uint16_t> materials;  // used by it
    Vec3d centre_m;
    double radius_m = 0;
    /// As far as it mirrors, which depends on the frequency: one for every set of its materials that does, or a ping would depend
    /// on those before it.
    struct Surface {
      std::vector<bool> mirrors;  // by material
      std::unique_ptr<const SpecularMesh> mesh;
    };
    std::vector<Surface> surfaces;  // oldest first
  };
  PreparedMesh& prepared(std::size_t object, const std::shared_ptr<const Mesh>& mesh);
  void candidates(const Object& object, PreparedMesh& mesh, const SpecularQuery& query);

  std::vector<PreparedMesh> meshes_;  // in the order in which they were met
  std::vector<std::size_t> mesh_of_;  // object to place in meshes_
  std::vector<double> reflection_;    // per material, this ping
  std::vector<bool> mirrors_;         // those of a mesh that do
  std::vector<SpecularPoint> points_;
};

}  // namespace sonar
