// Tracing with Embree. Versions 3 and 4 differ only in the shim below and in the include of embree_trees.hpp.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <type_traits>
#include <vector>

#include "core/base/load_step.hpp"
#include "core/scene/embree_trees.hpp"
#include "core/scene/extent.hpp"
#include "core/scene/ray_scene.hpp"

namespace sonar {
namespace {

using namespace embree;

// One query of 4, 8 or 16 rays. The meaning of `coherent` is expressed differently in the two versions.
#if SONAR_EMBREE_MAJOR >= 4
struct Query : RTCIntersectArguments {
  explicit Query(bool coherent) {
    rtcInitIntersectArguments(this);
    flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  }
};
void intersect(const int* valid, RTCScene scene, Query& query, RTCRayHit4& rays) { rtcIntersect4(valid, scene, &rays, &query); }
void intersect(const int* valid, RTCScene scene, Query& query, RTCRayHit8& rays) { rtcIntersect8(valid, scene, &rays, &query); }
void intersect(const int* valid, RTCScene scene, Query& query, RTCRayHit16& rays) { rtcIntersect16(valid, scene, &rays, &query); }
#else
struct Query : RTCIntersectContext {
  explicit Query(bool coherent) {
    rtcInitIntersectContext(this);
    flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }
};
void intersect(const int* valid, RTCScene scene, Query& query, RTCRayHit4& rays) { rtcIntersect4(valid, scene, &query, &rays); }
void intersect(const int* valid, RTCScene scene, Query& query, RTCRayHit8& rays) { rtcIntersect8(valid, scene, &query, &rays); }
void intersect(const int* valid, RTCScene scene, Query& query, RTCRayHit16& rays) { rtcIntersect16(valid, scene, &query, &rays); }
#endif

// One acceleration structure and the objects of its geometries. It holds all static objects, or one body.
struct Group {
  SceneHandle scene;
  std::vector<std::uint32_t> objects;
  std::size_t triangles = 0;
};

RTCSceneFlags flags_for(std::size_t triangles) {
  const int robust = RTC_SCENE_FLAG_ROBUST;  // a ray along the edge of two triangles must hit one of them
  const bool compact = triangles >= RayScene::compact_from_triangles;
  return static_cast<RTCSceneFlags>(compact ? robust | RTC_SCENE_FLAG_COMPACT : robust);
}

void add_object(const Device& device, Group& group, const Mesh& mesh, const Pose& placed, std::uint32_t object) {
  RTCGeometry geometry = rtcNewGeometry(device.handle, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
  // The mesh belongs to the scene, which outlives this geometry. Embree only reads the mesh.
  static_assert(sizeof(mesh.triangles[0]) == 3 * sizeof(std::uint32_t));
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0,
                             sizeof(mesh.triangles[0]), mesh.triangles.size());
  if (vertices) {
    place_vertices(mesh, placed, vertices);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(group.scene.handle, geometry, static_cast<unsigned>(group.objects.size()));
    group.objects.push_back(object);
    group.triangles += mesh.triangles.size();
  }
  rtcReleaseGeometry(geometry);
  device.check();
}

template <class Packet>
constexpr int lanes_of = std::extent_v<decltype(Packet::ray.org_x)>;

}  // namespace

struct RayScene::Impl {
  std::shared_ptr<const Scene> scene;
  int build_threads;
  Device device;
  int rays_at_once;
  Vec3d origin;
  std::vector<Group> groups;  // [0] everything static, [1 + b] body b
  SceneHandle top;            // instances of the groups; null if nothing moves
  std::vector<RTCGeometry> instances;
  std::vector<Pose> placed;      // the last poses of bodies
  std::vector<Rotation> turned;  // their rotations, for normals
  RTCScene traced = nullptr;
  std::vector<std::unique_ptr<ChangingGroup>> changing;  // groups made by change(); most recently used first

  Impl(std::shared_ptr<const Scene> s, int threads)
      : scene(std::move(s)),
        build_threads(threads < 1 ? 1 : threads),
        device(build_threads),
        rays_at_once(device.widest_packet()),
        origin(ray_origin_of(*scene)) {
    const std::size_t bodies = scene->bodies_in_world.size();
    for (std::size_t i = 0; i <= bodies; ++i) groups.push_back(Group{SceneHandle(device), {}, 0});
    for (std::size_t i = 0; i < scene->objects.size(); ++i) {
      const Object& object = scene->objects[i];
      if (!object.visible || object.mesh->triangles.empty()) continue;
      Pose placed_in_group = scene->in_body(object);
      if (object.body < 0) placed_in_group.position_m = placed_in_group.position_m - origin;
      add_object(device, groups[static_cast<std::size_t>(object.body + 1)], *object.mesh, placed_in_group,
                 static_cast<std::uint32_t>(i));
    }
    build_trees();
    begin_load_step("preparing for pings", scene->triangle_count());
    traced = groups[0].scene.handle;
    if (bodies > 0) make_top();
  }
  ~Impl() {
    for (RTCGeometry instance : instances) rtcReleaseGeometry(instance);
  }

  /// Changes the scene; neither the previous nor the new scene has bodies.
  void change(std::shared_ptr<const Scene> to) {
    constexpr std::size_t most_kept = 16, most_kept_triangles = 1'250'000;  // for scenes that alternate
    scene = std::move(to);
    origin = ray_origin_of(*scene);
    std::vector<ChangingGroup::Wanted> wanted;
    std::size_t triangles = 0;
    for (std::size_t i = 0; i < scene->objects.size(); ++i) {
      const Object& object = scene->objects[i];
      if (!object.visible || object.mesh->triangles.empty()) continue;
      Pose placed_in_group = object.in_world;
      placed_in_group.position_m = placed_in_group.position_m - origin;
      // Three numbers per corner, and one additional number, because Embree may read beyond the last.
      auto vertices = std::make_shared<std::vector<float>>(3 * object.mesh->vertices.size() + 1);
      place_vertices(*object.mesh, placed_in_group, vertices->data());
      wanted.push_back({object.mesh, std::move(vertices), static_cast<std::uint32_t>(i)});
      triangles += object.mesh->triangles.size();
    }
    // Finds the structure that already contains most of these objects. If reuse would not save time, makes a new one.
    auto best = changing.end();
    std::size_t there = 0;
    for (auto group = changing.begin(); group != changing.end(); ++group)
      if (const std::size_t n = (*group)->there(wanted); n > there) best = group, there = n;
    if (best == changing.end() || 2 * there < triangles) {
      std::size_t kept = triangles;
      const auto is_too_much = [&](const auto& group) { return (kept += group->triangles()) > most_kept_triangles; };
      changing.erase(std::ranges::find_if(changing, is_too_much), changing.end());
      if (changing.size() == most_kept) changing.pop_back();
      changing.insert(changing.begin(), std::make_unique<ChangingGroup>(device));
    } else {
      std::rotate(changing.begin(), best, best + 1);
    }
    groups[0].scene = {};
    groups[0].objects = changing.front()->become(device, wanted);
    traced = changing.front()->tree();
  }

  void build_trees() {
    begin_load_step("building the ray tracer's tree", scene->triangle_count());
    double all = 1;
    for (const Group& group : groups) all += static_cast<double>(group.triangles);
    struct {
      double before, share;  // fraction of finished groups, and of the current group
    } parts{0, 0};
    const auto tell = [](void* of, double part) {
      const auto& p = *static_cast<decltype(parts)*>(of);
      return load_step_reached(p.before + p.share * part), true;
    };
    for (Group& group : groups) {
      const RTCScene tree = group.scene.handle;
      parts = {parts.before + parts.share, static_cast<double>(group.triangles) / all};
      rtcSetSceneBuildQuality(tree, RTC_BUILD_QUALITY_HIGH);
      rtcSetSceneFlags(tree, flags_for(group.triangles));
      rtcSetSceneProgressMonitorFunction(tree, tell, &parts);
      rtcCommitScene(tree);
      rtcSetSceneProgressMonitorFunction(tree, nullptr, nullptr);
      device.check();
    }
  }
  // The static group also becomes an instance, so that the motion of a body changes only a few boxes.
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
      if (bodies[b] == placed[b]) continue;
      moved = true;
      placed[b] = bodies[b];
      turned[b + 1] = rotation_from(bodies[b].orientation);
      set_transform(b + 1, Pose{bodies[b].position_m - origin, bodies[b].orientation});
    }
    if (moved) rtcCommitScene(top.handle);
  }

  template <class Packet>
  void trace(RayPacket& rays, std::uint32_t active, Query& query) const {
    constexpr int lanes = lanes_of<Packet>;
    for (int first = 0; first < RayPacket::size; first += lanes) {
      const std::uint32_t here = (active >> first) & ((1u << lanes) - 1u);
      std::fill_n(rays.object + first, lanes, RayPacket::miss);
      if (here != 0) trace_lanes<Packet>(rays, first, here, query);
    }
  }

  /// Traces rays [first, first + lanes_of<Packet>), bit i of `active` for ray first + i.
  template <class Packet>
  void trace_lanes(RayPacket& rays, int first, std::uint32_t active, Query& query) const {
    constexpr int lanes = lanes_of<Packet>;
    alignas(64) int valid[lanes];
    alignas(64) Packet q{};
    for (int i = 0; i < lanes; ++i) valid[i] = (active >> i) & 1 ? -1 : 0;
    const auto give = [&](float(&to)[lanes], const float* from) { std::memcpy(to, from + first, sizeof to); };
    give(q.ray.org_x, rays.origin_x), give(q.ray.org_y, rays.origin_y), give(q.ray.org_z, rays.origin_z);
    give(q.ray.dir_x, rays.direction_x), give(q.ray.dir_y, rays.direction_y), give(q.ray.dir_z, rays.direction_z);
    give(q.ray.tfar, rays.far);
    std::memset(q.ray.mask, 0xFF, sizeof q.ray.mask);
    std::memset(q.hit.geomID, 0xFF, sizeof q.hit.geomID);
    std::memset(q.hit.instID, 0xFF, sizeof q.hit.instID);
    // An inactive lane gets a ray that ends before it begins. So Embree does not use its undefined values.
    for (int i = 0; i < lanes; ++i) {
      if (valid[i] != 0) continue;
      q.ray.org_x[i] = q.ray.org_y[i] = q.ray.org_z[i] = q.ray.dir_y[i] = q.ray.dir_z[i] = 0;
      q.ray.dir_x[i] = 1;
      q.ray.tfar[i] = -1;
    }
    intersect(valid, traced, query, q);

    const auto copy_back = [&](auto* to, const auto* from) {
      for (int i = 0; i < lanes; ++i) to[first + i] = valid[i] != 0 ? from[i] : to[first + i];
    };
    copy_back(rays.far, q.ray.tfar), copy_back(rays.triangle, q.hit.primID);
    copy_back(rays.normal_x, q.hit.Ng_x), copy_back(rays.normal_y, q.hit.Ng_y), copy_back(rays.normal_z, q.hit.Ng_z);
    for (int i = 0; i < lanes; ++i)
      if (valid[i] != 0 && q.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID)
        set_object(rays, first + i, q.hit.geomID[i], q.hit.instID[0][i]);
  }

  void set_object(RayPacket& rays, int lane, unsigned geometry, unsigned instance) const {
    const std::size_t group = instance == RTC_INVALID_GEOMETRY_ID ? 0 : instance;
    rays.object[lane] = groups[group].objects[geometry];
    if (group == 0) return;
    const auto& m = turned[group].m;  // Embree returns normals of bodies in the axes of the body
    const double n[3] = {rays.normal_x[lane], rays.normal_y[lane], rays.normal_z[lane]};
    rays.normal_x[lane] = static_cast<float>(m[0][0] * n[0] + m[0][1] * n[1] + m[0][2] * n[2]);
    rays.normal_y[lane] = static_cast<float>(m[1][0] * n[0] + m[1][1] * n[1] + m[1][2] * n[2]);
    rays.normal_z[lane] = static_cast<float>(m[2][0] * n[0] + m[2][1] * n[1] + m[2][2] * n[2]);
  }
};

RayScene::RayScene(std::shared_ptr<const Scene> scene, int build_threads)
    : impl_(std::make_unique<Impl>(std::move(scene), build_threads)) {}
RayScene::~RayScene() = default;
void RayScene::change(std::shared_ptr<const Scene> scene) {
  if (impl_->scene->bodies_in_world.empty() && scene->bodies_in_world.empty() && scene->triangle_count() < compact_from_triangles)
    impl_->change(std::move(scene));
  else
    impl_ = std::make_unique<Impl>(std::move(scene), impl_->build_threads);
}
const Scene& RayScene::scene() const { return *impl_->scene; }
Vec3d RayScene::origin() const { return impl_->origin; }
void RayScene::place(std::span<const Pose> bodies_in_world) { impl_->place(bodies_in_world); }

void RayScene::trace(RayPacket& rays, std::uint32_t active, bool coherent) const {
  static_assert(RayPacket::size == 16 && RayPacket::miss == RTC_INVALID_GEOMETRY_ID);
  Query query(coherent);
  switch (impl_->rays_at_once) {
    case 16:
      return impl_->trace<RTCRayHit16>(rays, active, query);
    case 8:
      return impl_->trace<RTCRayHit8>(rays, active, query);
    default:
      return impl_->trace<RTCRayHit4>(rays, active, query);
  }
}
int RayScene::rays_at_once() const { return impl_->rays_at_once; }

std::string RayScene::version() { return "Embree " RTC_VERSION_STRING; }

}  // namespace sonar
