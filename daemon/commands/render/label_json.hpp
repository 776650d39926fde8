// Labels as JSON: the instances of a scene, and the pixels of each in a ping, in COCO's format (docs/datasets.md).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/pipeline/labels.hpp"
#include "core/sonar/ping.hpp"

namespace sonar::render {

inline constexpr int cartesian_width_px = 1000;  // width of the fan to which `cartesian` refers, as in render's pictures

/// For each instance, from 1 on: its name, its class, and true if it is a thing. A thing is an object with a label of its own; it
/// has boxes and polygons.
nlohmann::json instances_of(const Scene& scene);

/// Annotations of every visible thing: `bbox`, `area` and `segmentation` in pixels of the samples (x = beam, y = row), and
/// under `cartesian` in pixels of the fan; `visible`, the unblocked fraction of its energy.
nlohmann::json annotations_of(const PingLabels& labels, const Ping& ping, const Scene& scene);

/// Returns the scale and origin of the Cartesian picture, which is the fan of --image-rings off.
nlohmann::json layout_of(const Ping& ping);

}  // namespace sonar::render
