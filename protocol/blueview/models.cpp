#include "protocol/blueview/models.hpp"

#include <array>

#include "core/base/geometry.hpp"

namespace sonar::blueview {
namespace {

// P25: Choi et al. 2025, tables 1 and 2. DS: figures of the P900 data sheet as quoted in a public note on IOES-Lab/dave.
constexpr double row_m = 0.0254;  // DS: range resolution, one inch
constexpr int preset_rows = 394;  // P25: 10 m

std::shared_ptr<const SonarModel> p900_90() {
  FrequencyMode mode;
  mode.name = "900 kHz";
  mode.centre_hz = 900e3f;                                                  // P25
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(90));      // P25, DS
  mode.min_range_m = 0.5f;                                                  // unknown: DS gives 2 m as the optimum only
  mode.max_range_m = 100;                                                   // DS
  mode.source_level_db = 210;                                               // unknown: inferred; P25 fitted 220
  mode.beam_spacing = BeamSpacing::uniform_in_angle;                        // DS: 512 beams 0.18 deg apart
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(1));     // DS
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(20));  // DS
  mode.receiver.full_scale_upa = 1e11f;                                     // unknown: fitted
  SonarModel model;
  model.profile = "blueview-p900-90";
  model.name = "BlueView P900-90";
  model.modes.push_back(mode);
  model.max_rate_hz = 15;  // DS
  return std::make_shared<const SonarModel>(std::move(model));
}

}  // namespace

std::span<const std::shared_ptr<const SonarModel>> models() {
  static const std::array<std::shared_ptr<const SonarModel>, 1> all{p900_90()};
  return all;
}

PingSettings p900_90_preset() {
  PingSettings settings;
  settings.beam_count = 512;
  settings.range_bin_count = preset_rows;
  settings.range_bin_m = row_m;
  settings.range_m = preset_rows * row_m;
  settings.pulse_width_m = static_cast<float>(row_m);  // DS: equal to the row
  settings.rate_hz = 15;
  settings.gain_db = 48;
  settings.format.bits = 16;  // unknown: BlueView images carry 16-bit samples
  settings.format.max_code = 65535;
  return settings;
}

}  // namespace sonar::blueview
