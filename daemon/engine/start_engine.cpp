#include "daemon/engine/start_engine.hpp"

#include <new>
#include <stdexcept>

namespace sonar {

Result<std::unique_ptr<PingEngine>> start_engine(const EngineFactory& make, std::shared_ptr<const Scene> scene) {
  const std::string where = "cannot start the simulation of scene " + scene->name + ": ";
  try {
    return make(std::move(scene));
  } catch (const std::bad_alloc&) {
    return failure(ErrorKind::unavailable, where + "not enough memory; use a smaller scene or free some");
  } catch (const std::runtime_error& e) {
    return failure(ErrorKind::unavailable, where + e.what());
  }
}

}  // namespace sonar
