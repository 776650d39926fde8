// An engine for pings of all modes (Switches::mode). It passes canonical pings to the given engine. It computes pings in the
// modes paper and raster itself, on the CPU.
#pragma once

#include <memory>

#include "core/paper/paper_signal.hpp"
#include "core/pipeline/ping_engine.hpp"

namespace sonar {

/// Adds the comparison modes (paper, raster) to an engine of canonical pings over the same scene. The modes need no time or
/// memory before the first such ping. Their pings contain only echoes of surfaces and point targets: no noise, no specular
/// echoes, no motion within the ping. Speckle differs between pings: the draw of each ray depends on (seed, ping number, beam,
/// ray).
std::unique_ptr<PingEngine> with_comparison_modes(std::unique_ptr<PingEngine> canonical, std::shared_ptr<const Scene> scene,
                                                  Parallel& pool, const EngineOptions& options,
                                                  paper::FrequencySum sum = paper::FrequencySum::fast);
/// Makes the CPU engine for all modes.
std::unique_ptr<PingEngine> make_engine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options = {},
                                        paper::FrequencySum sum = paper::FrequencySum::fast);

}  // namespace sonar
