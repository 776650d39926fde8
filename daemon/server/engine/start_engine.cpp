#include "daemon/server/engine/start_engine.hpp"

#include <new>
#include <stdexcept>

#include "core/base/memory_left.hpp"

namespace sonar {

namespace {

constexpr std::uint64_t memory_of_a_triangle = 250;  // bytes, while its acceleration structure is built; measured: 120 to 230

std::uint64_t triangles_of(const Scene& scene) {
  std::uint64_t triangles = 0;
  for (const Object& object : scene.objects) triangles += object.visible ? object.mesh->triangles.size() : 0;
  return triangles;
}

}  // namespace

Result<std::unique_ptr<PingEngine>> start_engine(const EngineFactory& make, std::shared_ptr<const Scene> scene) {
  const std::string where = "cannot start the simulation of scene " + scene->name + ": ";
  if (auto room = check_memory_for("its ray tracer", memory_of_a_triangle * triangles_of(*scene)); !room)
    return failure(room.error().kind, where + room.error().text);
  try {
    return make(std::move(scene));
  } catch (const std::bad_alloc&) {
    return failure(ErrorKind::unavailable, where + "not enough memory; use a smaller scene or free some");
  } catch (const std::runtime_error& e) {
    return failure(ErrorKind::unavailable, where + e.what());
  }
}

}  // namespace sonar
