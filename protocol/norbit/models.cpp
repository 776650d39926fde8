#include "protocol/norbit/settings.hpp"

#include <array>

#include "core/base/geometry.hpp"

namespace sonar::norbit {
namespace {

SonarModel make_model(const char* profile, const char* name, double along_track_deg) {
  FrequencyMode mode;
  mode.name = "400 kHz";
  mode.centre_hz = static_cast<float>(1e3 * frequency_khz);
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(swath_deg));
  mode.min_range_m = 0.2f;
  mode.max_range_m = static_cast<float>(farthest_m);
  mode.source_level_db = 210;  // unknown, like full scale
  mode.beam_spacing = BeamSpacing::uniform_in_angle;
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(beam_width_deg));
  mode.pattern.azimuth_taper = Taper::hamming;
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(along_track_deg));
  mode.receiver.full_scale_upa = 1e8f;
  SonarModel model;
  model.profile = profile;
  model.name = name;
  model.max_rate_hz = fastest_hz;
  model.modes = {mode};
  return model;
}

}  // namespace

std::span<const std::shared_ptr<const SonarModel>> models() {
  static const std::array<std::shared_ptr<const SonarModel>, 2> all{
      std::make_shared<const SonarModel>(make_model("norbit-wbms", "Norbit WBMS", 1.9)),
      std::make_shared<const SonarModel>(make_model("norbit-fls", "Norbit FLS", 20))};
  return all;
}

int mode_of(const SonarModel& model) { return model.profile == models().back()->profile ? 0 : 1; }

}  // namespace sonar::norbit
