// The only file that knows Embree; 3.x and 4.x differ in three places, all in the shim below.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "core/scene/ray_origin.hpp"
#include "core/scene/ray_scene.hpp"

#if SONAR_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace sonar {
namespace {

#if SONAR_EMBREE_MAJOR >= 4
void intersect_16(RTCScene scene, const int* valid, RTCRayHit16* rays, bool coherent) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  rtcIntersect16(valid, scene, rays, &arguments);
}
#else
void intersect_16(RTCScene scene, const int* valid, RTCRayHit16* rays, bool coherent) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  rtcIntersect16(valid, scene, &context, rays);
}
#endif

// Owners of Embree's reference-counted handles.
struct Device {
  RTCDevice handle;
  explicit Device(int threads) : handle(rtcNewDevice(("threads=" + std::to_string(threads)).c_str())) {
    if (!handle) throw std::runtime_error("the ray tracer (Embree) cannot start on this processor");
  }
  ~Device() { rtcReleaseDevice(handle); }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  void check() const {
    const RTCError error = rtcGetDeviceError(handle);
    if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::runtime_error("not enough memory to build the scene for ray tracing");
    if (error != RTC_ERROR_NONE) throw std::runtime_error("the ray tracer failed with code " + std::to_string(error));
  }
};
struct SceneHandle {
  RTCScene handle = nullptr;
  SceneHandle() = default;
  explicit SceneHandle(const Device& device) : handle(rtcNewScene(device.handle)) { device.check(); }
  ~SceneHandle() {
    if (handle) rtcReleaseScene(handle);
  }
  SceneHandle(SceneHandle&& o) noexcept : handle(o.handle) { o.handle = nullptr; }
  SceneHandle& operator=(SceneHandle&& o) noexcept {
    std::swap(handle, o.handle);
    return *this;
  }
};

// One acceleration structure, all static objects or one body, and which objects its geometries are.
struct Group {
  SceneHandle scene;
  std::vector<std::uint32_t> objects;
};

void add_object(const Device& device, Group& group, const Mesh& mesh, const Pose& placed, std::uint32_t object) {
  RTCGeometry geometry = rtcNewGeometry(device.handle, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
  auto* triangles = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                        3 * sizeof(std::uint32_t), mesh.triangles.size()));
  if (vertices && triangles) {
    const Rotation turn = rotation_from(placed.orientation);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
      const Vec3d v = to_double(mesh.vertices[i]);
      const double p[3] = {placed.position_m.x, placed.position_m.y, placed.position_m.z};
      for (int k = 0; k < 3; ++k) {
        vertices[3 * i + static_cast<std::size_t>(k)] =
            static_cast<float>(turn.m[k][0] * v.x + turn.m[k][1] * v.y + turn.m[k][2] * v.z + p[k]);
      }
    }
    static_assert(sizeof(mesh.triangles[0]) == 3 * sizeof(std::uint32_t));
    std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(group.scene.handle, geometry, static_cast<unsigned>(group.objects.size()));
    group.objects.push_back(object);
  }
  rtcReleaseGeometry(geometry);
  device.check();
}

bool same(const Pose& a, const Pose& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

}  // namespace

struct RayScene::Impl {
  std::shared_ptr<const Scene> scene;
  Device device;
  Vec3d origin;
  std::vector<Group> groups;  // [0] everything static, [1 + b] body b
  SceneHandle top;            // instances of the groups; null when nothing moves
  std::vector<RTCGeometry> instances;
  std::vector<Pose> placed;      // the bodies, as last placed
  std::vector<Rotation> turned;  // their rotations, for normals
  RTCScene traced = nullptr;

  Impl(std::shared_ptr<const Scene> s, int build_threads)
      : scene(std::move(s)), device(build_threads < 1 ? 1 : build_threads), origin(ray_origin_of(*scene)) {
    const std::size_t bodies = scene->bodies_in_world.size();
    for (std::size_t i = 0; i <= bodies; ++i) groups.push_back(Group{SceneHandle(device), {}});
    for (std::size_t i = 0; i < scene->objects.size(); ++i) {
      const Object& object = scene->objects[i];
      if (!object.visible || object.mesh->triangles.empty()) continue;
      Pose placed_in_group = scene->in_body(object);
      if (object.body < 0) placed_in_group.position_m = placed_in_group.position_m - origin;
      add_object(device, groups[static_cast<std::size_t>(object.body + 1)], *object.mesh, placed_in_group,
                 static_cast<std::uint32_t>(i));
    }
    for (Group& group : groups) {
      rtcSetSceneBuildQuality(group.scene.handle, RTC_BUILD_QUALITY_HIGH);
      rtcSetSceneFlags(group.scene.handle, RTC_SCENE_FLAG_ROBUST);  // a ray along the edge of two triangles must not slip through
      rtcCommitScene(group.scene.handle);
      device.check();
    }
    traced = groups[0].scene.handle;
    if (bodies > 0) make_top();
  }
  ~Impl() {
    for (RTCGeometry instance : instances) rtcReleaseGeometry(instance);
  }

  // The static group becomes an instance too: then moving a body rebuilds a handful of boxes and nothing else.
  void make_top() {
    top = SceneHandle(device);
    rtcSetSceneBuildQuality(top.handle, RTC_BUILD_QUALITY_LOW);
    rtcSetSceneFlags(top.handle, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_DYNAMIC | RTC_SCENE_FLAG_ROBUST));
    for (std::size_t i = 0; i < groups.size(); ++i) {
      RTCGeometry instance = rtcNewGeometry(device.handle, RTC_GEOMETRY_TYPE_INSTANCE);
      rtcSetGeometryInstancedScene(instance, groups[i].scene.handle);
      rtcSetGeometryTimeStepCount(instance, 1);
      instances.push_back(instance);
      set_transform(i, Pose{});
      rtcAttachGeometryByID(top.handle, instance, static_cast<unsigned>(i));
    }
    turned.resize(groups.size());
    traced = top.handle;
    place(scene->bodies_in_world);
    device.check();
  }

  void set_transform(std::size_t group, const Pose& in_origin) {
    const Rotation r = rotation_from(in_origin.orientation);
    const Vec3d t = in_origin.position_m;
    float columns[12];
    for (int c = 0; c < 3; ++c) {
      for (int k = 0; k < 3; ++k) columns[3 * c + k] = static_cast<float>(r.m[k][c]);
    }
    columns[9] = static_cast<float>(t.x), columns[10] = static_cast<float>(t.y), columns[11] = static_cast<float>(t.z);
    rtcSetGeometryTransform(instances[group], 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
    rtcCommitGeometry(instances[group]);
  }

  void place(std::span<const Pose> bodies) {
    if (!top.handle) return;
    if (bodies.empty()) bodies = scene->bodies_in_world;
    bool moved = placed.empty();
    placed.resize(groups.size() - 1, Pose{{HUGE_VAL, 0, 0}, {}});
    for (std::size_t b = 0; b < std::min(bodies.size(), placed.size()); ++b) {
      if (same(bodies[b], placed[b])) continue;
      moved = true;
      placed[b] = bodies[b];
      turned[b + 1] = rotation_from(bodies[b].orientation);
      set_transform(b + 1, Pose{bodies[b].position_m - origin, bodies[b].orientation});
    }
    if (moved) rtcCommitScene(top.handle);
  }
};

RayScene::RayScene(std::shared_ptr<const Scene> scene, int build_threads)
    : impl_(std::make_unique<Impl>(std::move(scene), build_threads)) {}
RayScene::~RayScene() = default;
const Scene& RayScene::scene() const { return *impl_->scene; }
Vec3d RayScene::origin() const { return impl_->origin; }
void RayScene::place(std::span<const Pose> bodies_in_world) { impl_->place(bodies_in_world); }

void RayScene::trace(RayPacket& rays, std::uint32_t active, bool coherent) const {
  static_assert(RayPacket::size == 16 && RayPacket::miss == RTC_INVALID_GEOMETRY_ID);
  alignas(64) int valid[16];
  alignas(64) RTCRayHit16 q;
  for (int i = 0; i < 16; ++i) valid[i] = (active >> i) & 1 ? -1 : 0;
  std::memcpy(q.ray.org_x, rays.origin_x, sizeof q.ray.org_x);
  std::memcpy(q.ray.org_y, rays.origin_y, sizeof q.ray.org_y);
  std::memcpy(q.ray.org_z, rays.origin_z, sizeof q.ray.org_z);
  std::memcpy(q.ray.dir_x, rays.direction_x, sizeof q.ray.dir_x);
  std::memcpy(q.ray.dir_y, rays.direction_y, sizeof q.ray.dir_y);
  std::memcpy(q.ray.dir_z, rays.direction_z, sizeof q.ray.dir_z);
  std::memcpy(q.ray.tfar, rays.far, sizeof q.ray.tfar);
  std::memset(q.ray.tnear, 0, sizeof q.ray.tnear);
  std::memset(q.ray.time, 0, sizeof q.ray.time);
  std::memset(q.ray.mask, 0xFF, sizeof q.ray.mask);
  std::memset(q.ray.id, 0, sizeof q.ray.id);
  std::memset(q.ray.flags, 0, sizeof q.ray.flags);
  std::memset(q.hit.geomID, 0xFF, sizeof q.hit.geomID);
  std::memset(q.hit.instID, 0xFF, sizeof q.hit.instID);
  intersect_16(impl_->traced, valid, &q, coherent);

  std::memcpy(rays.far, q.ray.tfar, sizeof rays.far);
  std::memcpy(rays.triangle, q.hit.primID, sizeof rays.triangle);
  std::memcpy(rays.normal_x, q.hit.Ng_x, sizeof rays.normal_x);
  std::memcpy(rays.normal_y, q.hit.Ng_y, sizeof rays.normal_y);
  std::memcpy(rays.normal_z, q.hit.Ng_z, sizeof rays.normal_z);
  for (int i = 0; i < 16; ++i) {
    rays.object[i] = RayPacket::miss;
    if (q.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    const std::uint32_t instance = q.hit.instID[0][i];
    const std::size_t group = instance == RTC_INVALID_GEOMETRY_ID ? 0 : instance;
    rays.object[i] = impl_->groups[group].objects[q.hit.geomID[i]];
    if (group == 0) continue;
    const auto& m = impl_->turned[group].m;  // a body's normals come in the body's axes
    const double n[3] = {q.hit.Ng_x[i], q.hit.Ng_y[i], q.hit.Ng_z[i]};
    rays.normal_x[i] = static_cast<float>(m[0][0] * n[0] + m[0][1] * n[1] + m[0][2] * n[2]);
    rays.normal_y[i] = static_cast<float>(m[1][0] * n[0] + m[1][1] * n[1] + m[1][2] * n[2]);
    rays.normal_z[i] = static_cast<float>(m[2][0] * n[0] + m[2][1] * n[1] + m[2][2] * n[2]);
  }
}

std::string RayScene::version() { return "Embree " RTC_VERSION_STRING; }

}  // namespace sonar
