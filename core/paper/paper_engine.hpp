// Chooses the engine of a ping by its mode (Switches::mode): the given engine computes canonical pings; pings in the modes paper
// and raster are computed here, on the CPU. core/pipeline does not depend on it.
#pragma once

#include <memory>

#include "core/paper/paper_signal.hpp"
#include "core/pipeline/ping_engine.hpp"

namespace sonar {

/// Adds the comparison modes to an engine of canonical pings over the same scene. They need no time or memory before the first
/// such ping. They contain echoes of surfaces and point targets only: no noise, no specular echoes, no motion within the ping.
/// Speckle differs between pings: each ray has a draw from (seed, ping number, beam, ray).
std::unique_ptr<PingEngine> with_comparison_modes(std::unique_ptr<PingEngine> canonical, std::shared_ptr<const Scene> scene,
                                                  Parallel& pool, const EngineOptions& options,
                                                  paper::FrequencySum sum = paper::FrequencySum::fast);
/// The CPU's engine for all modes.
std::unique_ptr<PingEngine> make_engine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options = {},
                                        paper::FrequencySum sum = paper::FrequencySum::fast);

}  // namespace sonar
