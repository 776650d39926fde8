#include "protocol/waterlinked/settings.hpp"

#include <array>

#include "core/base/geometry.hpp"

namespace sonar::waterlinked {

// Sources. DOC: the vendor's public documentation. SMP: a recording of a real unit. unknown: centre of the low frequency
// (from memory), beams of the high frequency, range resolution. Beam width of the low frequency: the strengths in neighbouring
// columns have a correlation of 0.7 with 0.9 degrees, and of 0.85 with 1.5 degrees; SMP has 0.62.
std::span<const ModeRow> mode_rows() {
  static constexpr std::array<ModeRow, 2> all{{
      {"low-frequency", 1.2e6, 90, 40, 0.9, 1.5, 0.02, 5},    // DOC, SMP: field of view; DOC: rate
      {"high-frequency", 2.4e6, 40, 40, 0.7, 0.7, 0.01, 20},  // DOC: frequency, field of view, rate
  }};
  return all;
}

std::span<const std::shared_ptr<const SonarModel>> models() {
  static const std::array<std::shared_ptr<const SonarModel>, 1> built = [] {
    SonarModel model;
    model.profile = "waterlinked-3d15";
    model.name = "Sonar 3D-15";
    model.part_number = 21045;  // DOC: product_id
    model.max_rate_hz = 20;
    for (const ModeRow& row : mode_rows()) {
      FrequencyMode mode;
      mode.name = row.name;
      mode.centre_hz = static_cast<float>(row.centre_hz);
      mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(row.horizontal_deg));
      mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(row.vertical_deg));
      mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(row.beam_width_deg));
      mode.beam_spacing = BeamSpacing::uniform_in_angle;
      mode.min_range_m = 0;
      mode.max_range_m = static_cast<float>(longest_range_m);
      // unknown: levels. In SMP the level falls with range by about 20 log r less than two-way spreading, so the gain increases
      // by 20 log r.
      mode.source_level_db = 200;
      mode.receiver.tvg_slope_db = 20;
      mode.receiver.tvg_ceiling_db = 60;
      mode.receiver.full_scale_upa = 1e9f;
      model.modes.push_back(std::move(mode));
    }
    return std::array<std::shared_ptr<const SonarModel>, 1>{std::make_shared<const SonarModel>(std::move(model))};
  }();
  return built;
}

}  // namespace sonar::waterlinked
