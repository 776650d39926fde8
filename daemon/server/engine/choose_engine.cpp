#include "daemon/server/engine/choose_engine.hpp"

#include <stdexcept>

#include "core/paper/paper_engine.hpp"
#include "cuda/cuda_engine.hpp"

namespace sonar {
std::unique_ptr<PingEngine> choose_engine(EngineDevice device, std::shared_ptr<const Scene> scene, Parallel& pool,
                                          const EngineOptions& options, std::function<void(const std::string&)> say) {
  if (device == EngineDevice::cpu) return make_engine(std::move(scene), pool, options);
  cuda::DeviceEngineOptions device_options;
  device_options.say = say;
  device_options.cpu_after_failure = device == EngineDevice::automatic;
  auto engine = make_cuda_engine(scene, pool, options, device_options);
  if (engine) return with_comparison_modes(*std::move(engine), std::move(scene), pool, options);
  if (device == EngineDevice::cuda) throw std::runtime_error(engine.error().text + "; use --engine cpu or auto");
  if (say) say("engine auto: " + engine.error().text);
  return make_engine(std::move(scene), pool, options);
}

}  // namespace sonar
