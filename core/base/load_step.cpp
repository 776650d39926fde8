#include "core/base/load_step.hpp"

#include <atomic>
#include <mutex>

namespace sonar {
namespace {

struct {
  std::mutex mutex;
  std::string what;
  std::atomic<double> part = 0;
} step;

}  // namespace

void begin_load_step(std::string what, std::uint64_t triangles) {
  const std::lock_guard lock(step.mutex);
  step.what = triangles < 300'000 ? "" : std::move(what);
  step.part.store(0, std::memory_order_relaxed);
}
void load_step_reached(double part) { step.part.store(part, std::memory_order_relaxed); }
LoadStep load_step() {
  const std::lock_guard lock(step.mutex);
  return {step.what, step.part.load(std::memory_order_relaxed)};
}

}  // namespace sonar
