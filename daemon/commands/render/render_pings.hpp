// Renders the pings of a job into a folder, each as arrays, pictures and a sidecar (docs/render.md). Finished pings are kept, so
// that an interrupted run continues where it stopped.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/base/parallel.hpp"
#include "daemon/commands/render/output_folder.hpp"
#include "daemon/commands/render/render_job.hpp"

namespace sonar::render {

struct Progress {
  std::uint64_t done = 0, all = 0, kept = 0;
  std::uint64_t bytes = 0;  // bytes written
};

/// Returns the times of the requested pings of a job. Error usage: there are fewer poses than pings.
Result<std::vector<Time>> firing_times(const RenderJob& job, const OutputOptions& options);

/// Returns a sentence if in some pings the sonar is above the sea surface, or above z = 0 in a scene without a surface. Returns
/// an empty text otherwise, and if firing_times() fails.
std::string note_of_air(const RenderInput& input, const OutputOptions& options);

/// Calls `on_progress` after each batch, and for each ping that exists already. Errors: io; requests that the engine rejects.
Result<Progress> render_pings(const RenderInput& input, const OutputOptions& options, Parallel& pool,
                              const std::function<void(const Progress&)>& on_progress);

}  // namespace sonar::render
