// Options of an emulated Oculus, by name, under `options:` of a sonar in the configuration. Each selects a behaviour that the
// public sources do not state, or on which they contradict each other. The first allowed value is the default.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "core/sonar/sonar_model.hpp"
#include "protocol/vendor.hpp"

namespace sonar::oculus {

namespace option_name {
inline constexpr std::string_view before_first_fire = "before_first_fire", gain_echo = "gain_echo", gain_assist = "gain_assist",
                                  row_gain = "row_gain", pulse = "pulse", ping_start_time_unit = "ping_start_time_unit",
                                  honour_network_speed = "honour_network_speed", reply_version = "reply_version",
                                  out_of_range = "out_of_range", user_config_write = "user_config_write",
                                  status_bit7 = "status_bit7", row_rate_hz = "row_rate_hz", row_origin = "row_origin",
                                  dummy_period_ms = "dummy_period_ms", boot_text = "boot_text",
                                  lf_aperture_deg = "lf_aperture_deg", hf_aperture_deg = "hf_aperture_deg",
                                  lf_azimuth_width_deg = "lf_azimuth_width_deg", hf_azimuth_width_deg = "hf_azimuth_width_deg",
                                  lf_elevation_width_deg = "lf_elevation_width_deg",
                                  hf_elevation_width_deg = "hf_elevation_width_deg", elevation_width_is = "elevation_width_is";
}

std::span<const protocol::Option> options();
using protocol::given_number;
using protocol::number_option;
using protocol::text_option;

/// The rows of the table in docs/protocols/oculus.md, section 7: name, values, default, meaning.
std::string options_table();

/// The model of a product, whose apertures and beam widths no public source states, with the values of the options; without such
/// options, the model itself. Error: a value for a mode that the product lacks.
Result<std::shared_ptr<const SonarModel>> tuned(std::shared_ptr<const SonarModel> model, const protocol::OptionValues& options);

}  // namespace sonar::oculus
