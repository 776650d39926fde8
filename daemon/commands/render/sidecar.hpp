// The JSON file beside a rendered ping: all its parameters and the ground truth; and the digest of the inputs, which identifies
// files that need not be rendered again.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/pipeline/ping_engine.hpp"
#include "daemon/commands/render/render_job.hpp"

namespace sonar::render {

/// `engine`: its description; `count`: of that ping.
nlohmann::json sidecar(const RenderJob& job, const Ping& ping, const std::string& engine, const PingStatistics& count,
                       const std::string& digest);

/// SHA-256 of what the pings depend on: the files' text, the scene as loaded, the sonar, switches, seed, poses and times.
/// Threads and the number of pings do not count. `plain_pictures`: without rings.
std::string digest_of(const RenderInput& input, double rate_hz, bool plain_pictures = false);

}  // namespace sonar::render
