// Chooses the engine that computes the pings: the CPU's, a device's, or the device's if there is one (docs/cuda.md). Used by
// `sonard run` and `sonard render`.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/pipeline/ping_engine.hpp"
#include "daemon/config/config.hpp"

namespace sonar {

/// `say` gets the reason why the CPU computes instead of a requested device, on the thread that makes or runs the engine. Throws
/// std::runtime_error, which start_engine turns into a sentence, when a required device is missing; a required device that fails
/// later is EngineUnavailable, while `automatic` continues with the CPU. The pool must outlive the engine.
std::unique_ptr<PingEngine> choose_engine(EngineDevice device, std::shared_ptr<const Scene> scene, Parallel& pool,
                                          const EngineOptions& options, std::function<void(const std::string&)> say);

}  // namespace sonar
