// The contact sheet of a data set: pings as an operator sees them, each beside its labels.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "core/base/result.hpp"
#include "core/image/raster.hpp"
#include "core/scene/scene.hpp"
#include "core/sonar/ping.hpp"

namespace sonar::dataset {

/// Numbers of the pings that the sheet shows, spread over the set.
std::vector<std::uint64_t> pings_on_sheet(std::uint64_t pings);

/// The fan, and beside it the same fan dimmed, with things in a colour of their class, shadows in blue, and a box around each
/// thing. `annotations` as render::annotations_of(). nullopt for a ping of one beam. Needs the ping's labels.
Result<std::optional<Raster>> contact_cell(const Ping& ping, const Scene& scene, const nlohmann::json& annotations);

/// `cells` must not be empty.
Raster contact_sheet(const std::vector<Raster>& cells);

}  // namespace sonar::dataset
