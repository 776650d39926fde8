#include "cuda/cuda_engine.hpp"

#include <stdexcept>

#include "cuda/machine.hpp"

namespace sonar {

Result<std::unique_ptr<PingEngine>> make_cuda_engine(std::shared_ptr<const Scene> scene, Parallel& pool,
                                                     const EngineOptions& options, cuda::DeviceEngineOptions device_options) {
  auto machine = cuda::open_cuda_machine();
  if (!machine) return failure(ErrorKind::unavailable, "no CUDA engine (CUDA: " + machine.error().text + ")");
  // The tables of the scene are sent now, so that a device without memory for them fails immediately.
  try {
    return cuda::make_device_engine(std::move(scene), pool, options, *std::move(machine), std::move(device_options));
  } catch (const std::runtime_error& e) {
    return failure(ErrorKind::unavailable, std::string("no CUDA engine (CUDA: ") + e.what() + ")");
  }
}

}  // namespace sonar
