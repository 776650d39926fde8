// Implements RayScene with the device's own rays instead of Embree. A program that is linked with this file has one tracer for
// CPU and device, so that only arithmetic can differ.
#include "core/scene/ray_scene.hpp"
#include "cuda/flat_scene.hpp"
#include "cuda/trace_ray.hpp"

namespace sonar {

struct RayScene::Impl {
  std::shared_ptr<const Scene> scene;
  cuda::FlatScene flat;
  cuda::BodyPlaces places;
};

RayScene::RayScene(std::shared_ptr<const Scene> scene, int)
    : impl_(std::make_unique<Impl>(Impl{scene, cuda::FlatScene(*scene), {}})) {
  place({});
}
RayScene::~RayScene() = default;
void RayScene::change(std::shared_ptr<const Scene> scene) {
  impl_ = std::make_unique<Impl>(Impl{scene, cuda::FlatScene(*scene), {}});
  place({});
}
const Scene& RayScene::scene() const { return *impl_->scene; }
Vec3d RayScene::origin() const { return impl_->flat.origin(); }
void RayScene::place(std::span<const Pose> bodies) { impl_->places = impl_->flat.place(bodies); }
int RayScene::rays_at_once() const { return 1; }
std::string RayScene::version() { return "the device's rays"; }

void RayScene::trace(RayPacket& rays, std::uint32_t active, bool) const {
  const cuda::TracerView view = host_view(impl_->flat, impl_->places);
  for (int i = 0; i < RayPacket::size; ++i) {
    rays.object[i] = RayPacket::miss;
    if (((active >> i) & 1u) == 0) continue;
    rays.normal_x[i] = rays.normal_y[i] = rays.normal_z[i] = 0;
    const cuda::Ray ray{{rays.origin_x[i], rays.origin_y[i], rays.origin_z[i]},
                        {rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]}};
    const cuda::RayHit hit = trace_ray(view, ray, rays.far[i]);
    rays.object[i] = hit.object;
    if (hit.object == RayPacket::miss) continue;
    rays.far[i] = hit.range_m;
    rays.triangle[i] = hit.triangle;
    rays.normal_x[i] = hit.normal.x, rays.normal_y[i] = hit.normal.y, rays.normal_z[i] = hit.normal.z;
  }
}

}  // namespace sonar
