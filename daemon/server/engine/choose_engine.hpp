// Chooses the engine that computes the pings: cpu, a CUDA device, or automatic, which uses a device if there is one
// (docs/cuda.md).
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/pipeline/ping_engine.hpp"
#include "daemon/config/config.hpp"

namespace sonar {

/// Makes the engine. `say` is called with the reason if the CPU replaces a requested device, on the thread that makes or runs the
/// engine. If a required device is missing, throws std::runtime_error, which start_engine converts to a sentence. If a device
/// fails later, a required one causes EngineUnavailable, and `automatic` continues with the CPU. The pool must outlive the
/// engine.
std::unique_ptr<PingEngine> choose_engine(EngineDevice device, std::shared_ptr<const Scene> scene, Parallel& pool,
                                          const EngineOptions& options, std::function<void(const std::string&)> say);

}  // namespace sonar
