// The ping engine of the daemon and of the offline renderer: canonical pings go to the CPU engine, those in paper or raster mode
// (Switches::mode) are made here. Stands beside core/pipeline, so that the pipeline need not know of it.
#pragma once

#include <memory>

#include "core/paper/paper_signal.hpp"
#include "core/pipeline/ping_engine.hpp"

namespace sonar {

/// Like make_cpu_engine, and knows every Mode. The comparison modes build their rays' scene when the first ping asks for them:
/// until then they cost nothing. They hear surfaces and point targets only: no noise, no mirrors, no motion within the ping.
/// Speckle is drawn anew for every ping, a draw a ray, from (seed, ping number, beam, ray).
std::unique_ptr<PingEngine> make_engine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options = {},
                                        paper::FrequencySum sum = paper::FrequencySum::fast);

}  // namespace sonar
