// Renders the pings of a job into a folder: arrays, pictures and a sidecar each (docs/render.md). What is finished there is
// kept, so that a run that was broken off goes on where it stopped.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "core/base/parallel.hpp"
#include "daemon/render/render_job.hpp"

namespace sonar::render {

struct OutputOptions {
  std::filesystem::path folder;
  bool npy = true, png = true, raw = false, complex = false;
  int batch = 1;                       // pings that are made before they are written, by all threads at once
  bool overwrite = false;              // pings of other inputs in the folder are removed
  std::optional<std::uint64_t> pings;  // of each job; nothing: one, or one for every pose of the file
  std::optional<double> rate_hz;       // nothing: as the settings say, or at every pose
};

struct Progress {
  std::uint64_t done = 0, all = 0, kept = 0;
  std::uint64_t bytes = 0;  // written
};

/// When the pings of a job are fired [s]. usage: more pings than the poses last.
Result<std::vector<Time>> firing_times(const RenderJob& job, const OutputOptions& options);

/// `told` after every ping, in order. Errors: io; what the engine refuses.
Result<Progress> render_pings(const RenderInput& input, const OutputOptions& options, Parallel& pool,
                              const std::function<void(const Progress&)>& told);

}  // namespace sonar::render
