// Chooses the engine that computes the pings: cpu, a CUDA device, or automatic, which uses a device if there is one
// (docs/cuda.md).
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/pipeline/ping_engine.hpp"
#include "daemon/config/config.hpp"

namespace sonar {

/// `say` is called with the reason if the CPU replaces a requested device, on the thread that makes or runs the engine. Throws
/// std::runtime_error, which start_engine converts to a sentence, if a required device is missing. If a device fails later:
/// EngineUnavailable if it is required; `automatic` continues with the CPU. The pool must outlive the engine.
std::unique_ptr<PingEngine> choose_engine(EngineDevice device, std::shared_ptr<const Scene> scene, Parallel& pool,
                                          const EngineOptions& options, std::function<void(const std::string&)> say);

}  // namespace sonar
