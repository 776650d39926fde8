// Embree's handles, and trees that change from scene to scene. Only embree_scene.cpp may include this file.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/scene/ray_scene.hpp"

#if SONAR_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace sonar::embree {

// SONARD_EMBREE_ISA limits Embree to a lower instruction set than that of the processor, so that tests can run the code of
// other machines.
inline std::string device_settings(int threads) {
  // No geometry is tessellated. Embree's cache for tessellation would take 128 MB of address space; if they are not
  // available, Embree keeps a lock, and rtcReleaseDevice then never returns.
  std::string settings = "tessellation_cache_size=0,threads=" + std::to_string(threads);
  const char* isa = std::getenv("SONARD_EMBREE_ISA");
  if (isa == nullptr || *isa == '\0') return settings;
  constexpr std::string_view known[] = {"sse2", "sse4.2", "avx", "avx2", "avx512"};
  if (std::find(std::begin(known), std::end(known), isa) == std::end(known))
    throw std::runtime_error(std::string("SONARD_EMBREE_ISA: unknown instruction set \"") + isa +
                             "\"; use sse2, sse4.2, avx, avx2 or avx512");
  // For avx512 no limit is passed, because Embree's name for it differs between versions, and Embree uses SSE2 for an unknown
  // name.
  return isa == std::string_view("avx512") ? settings : settings + ",max_isa=" + isa;
}

inline std::string why_not(RTCError error) {
  const std::string cure = "; use a smaller scene, or raise the limits of memory (ulimit -v, LimitAS=, MemoryMax=)";
  if (error == RTC_ERROR_UNSUPPORTED_CPU) return " on this processor";
  if (error == RTC_ERROR_OUT_OF_MEMORY) return ": not enough memory" + cure;
  return ": code " + std::to_string(error) + "; memory or threads may be short" + cure + " and threads (ulimit -u)";
}

// Owners of Embree's reference-counted handles.
struct Device {
  RTCDevice handle;
  explicit Device(int threads) : handle(rtcNewDevice(device_settings(threads).c_str())) {
    if (!handle) throw std::runtime_error("the ray tracer (Embree) cannot start" + why_not(rtcGetDeviceError(nullptr)));
  }
  ~Device() { rtcReleaseDevice(handle); }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  void check() const {
    const RTCError error = rtcGetDeviceError(handle);
    if (error != RTC_ERROR_NONE) throw std::runtime_error("the ray tracer (Embree) cannot build the scene" + why_not(error));
  }
  // The widest packet of rays for which Embree has code on this processor. Embree traces wider packets as a stream. A stream is
  // slower, and Embree 3.13 then also reads rays that `valid` excludes.
  int widest_packet() const {
    if (rtcGetDeviceProperty(handle, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0) return 16;
    return rtcGetDeviceProperty(handle, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0 ? 8 : 4;
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

/// Computes the corners in the coordinates of rays.
inline void place_vertices(const Mesh& mesh, const Pose& placed, float* to) {
  const Rotation turn = rotation_from(placed.orientation);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vec3d v = to_double(mesh.vertices[i]);
    const double p[3] = {placed.position_m.x, placed.position_m.y, placed.position_m.z};
    for (int k = 0; k < 3; ++k) {
      to[3 * i + static_cast<std::size_t>(k)] =
          static_cast<float>(turn.m[k][0] * v.x + turn.m[k][1] * v.y + turn.m[k][2] * v.z + p[k]);
    }
  }
}

/// A structure that changes from scene to scene. Each geometry has its own tree, which is kept while the geometry does not
/// change.
class ChangingGroup {
 public:
  struct Wanted {
    std::shared_ptr<const Mesh> mesh;
    std::shared_ptr<const std::vector<float>> vertices;  // corners in the coordinates of rays
    std::uint32_t object = 0;
  };

  explicit ChangingGroup(const Device& device) : scene_(device) {
    rtcSetSceneBuildQuality(scene_.handle, RTC_BUILD_QUALITY_LOW);
    rtcSetSceneFlags(scene_.handle, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_DYNAMIC | RTC_SCENE_FLAG_ROBUST));
  }
  RTCScene tree() const { return scene_.handle; }

  std::size_t triangles() const {
    std::size_t sum = 0;
    for (const Standing& s : standing_) sum += s.mesh->triangles.size();
    return sum;
  }
  /// Number of triangles of `wanted` whose tree already exists.
  std::size_t there(const std::vector<Wanted>& wanted) const {
    std::size_t triangles = 0;
    for (const Wanted& w : wanted)
      if (std::ranges::any_of(standing_, [&](const Standing& s) { return s.is(w); })) triangles += w.mesh->triangles.size();
    return triangles;
  }
  /// Changes the structure to the wanted geometries. Returns the object of each geometry by geometry number.
  std::vector<std::uint32_t> become(const Device& device, const std::vector<Wanted>& wanted) {
    for (Standing& s : standing_) s.object = RayPacket::miss;
    std::vector<const Wanted*> missing;
    for (const Wanted& w : wanted) {
      const auto same =
          std::ranges::find_if(standing_, [&](const Standing& s) { return s.object == RayPacket::miss && s.is(w); });
      if (same == standing_.end())
        missing.push_back(&w);
      else
        same->object = w.object;
    }
    std::erase_if(standing_, [&](const Standing& s) {
      if (s.object == RayPacket::miss) rtcDetachGeometry(scene_.handle, s.number);
      return s.object == RayPacket::miss;
    });
    for (const Wanted* w : missing) add(device, *w);
    rtcCommitScene(scene_.handle);
    device.check();
    std::vector<std::uint32_t> objects;
    for (const Standing& s : standing_) {
      if (objects.size() <= s.number) objects.resize(s.number + 1, RayPacket::miss);
      objects[s.number] = s.object;
    }
    return objects;
  }

 private:
  struct Standing {
    std::shared_ptr<const Mesh> mesh;
    std::shared_ptr<const std::vector<float>> vertices;
    unsigned number = 0;
    std::uint32_t object = 0;
    bool is(const Wanted& w) const { return mesh == w.mesh && *vertices == *w.vertices; }
  };
  void add(const Device& device, const Wanted& w) {
    RTCGeometry geometry = rtcNewGeometry(device.handle, RTC_GEOMETRY_TYPE_TRIANGLE);
    const auto buffer = [&](RTCBufferType type, RTCFormat format, const auto& values, std::size_t size, std::size_t count) {
      rtcSetSharedGeometryBuffer(geometry, type, 0, format, values.data(), 0, size, count);
    };
    buffer(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, *w.vertices, 3 * sizeof(float), w.mesh->vertices.size());
    buffer(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, w.mesh->triangles, sizeof(w.mesh->triangles[0]), w.mesh->triangles.size());
    rtcCommitGeometry(geometry);
    standing_.push_back({w.mesh, w.vertices, rtcAttachGeometry(scene_.handle, geometry), w.object});
    rtcReleaseGeometry(geometry);
    device.check();
  }

  std::vector<Standing> standing_;  // must outlive the geometries, because they read it
  SceneHandle scene_;
};

}  // namespace sonar::embree
