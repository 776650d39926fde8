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

/// SHA-256 of everything that determines the pings: the files' text, the loaded scene, the sonar, switches, seed, poses and
/// times; not threads and the number of pings. `plain_pictures`: without rings.
std::string digest_of(const RenderInput& input, double rate_hz, bool plain_pictures = false);

}  // namespace sonar::render
