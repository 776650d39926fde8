// Which engine computes the pings: the CPU's, a device's, or the device's where there is one (docs/cuda.md). For `sonard run` and
// `sonard render`.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/pipeline/ping_engine.hpp"
#include "daemon/config/config.hpp"

namespace sonar {

/// `say` is told why the CPU computes where a device was wished for, on the thread that makes the engine or runs it. Throws
/// std::runtime_error, which start_engine makes a sentence of, when there must be a device and is none; with such a wish, a
/// device that fails later is EngineUnavailable, while `automatic` goes on with the CPU. The pool must outlive the engine.
std::unique_ptr<PingEngine> choose_engine(EngineDevice device, std::shared_ptr<const Scene> scene, Parallel& pool,
                                          const EngineOptions& options, std::function<void(const std::string&)> say);

}  // namespace sonar
