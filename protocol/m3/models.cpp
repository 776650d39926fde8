#include "protocol/m3/settings.hpp"

#include "core/base/geometry.hpp"
#include "protocol/m3/messages.hpp"

namespace sonar::m3 {
namespace {

// protocol/m3/README.md explains the sources PKT and LOG.
constexpr double elevation_deg = 30;  // recalled from the data sheet
constexpr double elements = 64;       // PKT
// unknown: levels. Full scale is chosen so that the strongest echoes of the demo scene have about the level of the strongest
// echoes in PKT.
constexpr float source_level_db = 210, full_scale_upa = 1.5e8f;

/// Makes the model with the mode "Imaging 3" of PKT; other modes are not emulated.
SonarModel make_model() {
  FrequencyMode mode;
  mode.name = "Imaging 3";
  mode.centre_hz = 500e3f;  // PKT
  mode.min_range_m = static_cast<float>(nearest_m);
  mode.max_range_m = static_cast<float>(farthest_m * fastest_mps / slowest_mps);
  mode.source_level_db = source_level_db;
  mode.beam_spacing = BeamSpacing::listed;
  for (int i = 0; i < beam_count; ++i)
    mode.beam_azimuths_rad.push_back(rad_from_deg((0.5 * (beam_count - 1) - i) * beam_spacing_deg));
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(beam_count * beam_spacing_deg));
  mode.pattern.azimuth_width_rad = static_cast<float>(0.886 * 2 / elements);  // elements at half a wavelength: 1.6 degrees
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(elevation_deg));
  mode.waveform.shape = Waveform::Shape::cw;  // PKT: a tone burst
  mode.receiver.tvg_slope_db = 20;            // PKT, with the absorption of the settings
  mode.receiver.tvg_minimum_range_m = static_cast<float>(nearest_m);
  mode.receiver.tvg_ceiling_db = GainLaw{}.limit_db;
  mode.receiver.full_scale_upa = full_scale_upa;
  SonarModel model;
  model.profile = "m3";
  model.name = "M3";
  model.max_rate_hz = highest_rate_hz;
  model.modes = {mode};
  return model;
}

}  // namespace

std::span<const std::shared_ptr<const SonarModel>> models() { return protocol::only_model<make_model>(); }

}  // namespace sonar::m3
