// Makes the JSON file beside a rendered ping, which has all parameters and the ground truth, and the digest of the inputs, which
// identifies files that need not be rendered again.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "core/pipeline/labels.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "core/sonar/ping.hpp"
#include "daemon/commands/render/render_job.hpp"

namespace sonar::render {

/// Returns the JSON file of a ping. `engine`: description of the engine; `count`: statistics of this ping.
nlohmann::json sidecar(const RenderJob& job, const Ping& ping, const std::string& engine, const PingStatistics& count,
                       const std::string& digest);

/// Returns the SHA-256 of everything that determines the pings: the files' text, the loaded scene, the sonar, switches, seed,
/// poses and times, but not the threads and the number of pings. `plain_pictures`: without rings.
std::string digest_of(const RenderInput& input, double rate_hz, bool plain_pictures = false);

// Makes the headers of NumPy arrays (.npy, format version 1.0). The little-endian bytes follow a header, last index fastest.

/// Returns the header, whose size is a multiple of 64. `type`: "<f4", "<c8", "|u1", "<u2" or "<u4".
std::string npy_header(std::string_view type, std::initializer_list<std::size_t> shape);

inline std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text.data(), text.size())); }

// Writes labels as JSON in COCO's format: the instances of a scene, and the pixels of each instance in a ping (docs/datasets.md).

inline constexpr int cartesian_width_px = 1000;  // width of the fan to which `cartesian` refers, as in render's pictures

/// Returns for each instance, from 1 on, the name, the class, and true if it is a thing. A thing is an object with its own label;
/// it has boxes and polygons.
nlohmann::json instances_of(const Scene& scene);

/// Returns annotations of every visible thing: `bbox`, `area` and `segmentation` in pixels of the samples (x = beam, y = row),
/// and under `cartesian` in pixels of the fan; `visible`, the fraction of the thing's echo energy that nothing blocks.
nlohmann::json annotations_of(const PingLabels& labels, const Ping& ping, const Scene& scene);

/// Returns the scale and origin of the Cartesian picture, which is the fan of --image-rings off.
nlohmann::json layout_of(const Ping& ping);

}  // namespace sonar::render
