// Converts a fire message to PingSettings: rows, rates, gain, gamma, limits, the device's own sound speed. encode_ping.hpp
// converts in the other direction.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/sonar/ping_settings.hpp"
#include "core/sonar/sonar_model.hpp"
#include "protocol/oculus/fire.hpp"
#include "protocol/vendor.hpp"

namespace sonar::oculus {

// Options of an emulated Oculus, by name, under `options:` of a sonar in the configuration. Each selects a behaviour that the
// public sources do not state, or on which they contradict each other. The first allowed value is the default.

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

/// Returns the rows of the table in docs/protocols/oculus.md, section 7: name, values, default, meaning.
std::string options_table();

/// Returns the model with apertures and beam widths, which no public source states, from the options; without such options, the
/// model itself. Errors: config for a mode that the product lacks.
Result<std::shared_ptr<const SonarModel>> tuned(std::shared_ptr<const SonarModel> model, const protocol::OptionValues& options);

/// Sample rate of the rows: 37.5 MHz / 143, exact in the capture (M1200d, mode 2). unknown: the rate of other modes; sonard
/// uses the same.
inline constexpr double row_rate_hz = 37.5e6 / 143.0;
inline constexpr double db_per_percent = 0.96;    // vendor note quoted in liboculus issue 13: 0-100 % is 0-96 dB
inline constexpr int row_limit = 720;             // liboculus node README, measured by its authors
inline constexpr double row_gain_from_m = 0.58;   // fitted to FIL's row gains, docs/decisions/0025-oculus-evidence.md
inline constexpr double native_pulse_m = 0.0025;  // the finest range resolution in the data sheets

/// Rows of a ping (docs/protocols/oculus.md, 5.4): c / (2 fs) doubled until at most 720 rows cover the range.
struct RowGrid {
  double spacing_m = 0;
  int count = 1;
};
RowGrid row_grid(double range_m, double sound_speed_mps, double rate_hz = row_rate_hz);

/// Returns the rate of a code [Hz]; 0 = standby. Unknown codes count as 10 Hz (our choice).
double table_rate_hz(PingRate rate);
/// Returns the exponent of the samples: value / 255, but 1 for the value 0.
float gamma_from_byte(std::uint8_t value);
/// Returns the format of the samples that a fire message requests: bits, saturation, gamma, row gains.
SampleFormat sample_format(const FireRequest& fire);
/// Returns the echoed gain in per cent (docs/protocols/oculus.md, 5.5): in mode 2 without flag bit 4 a gain of g is echoed as 40
/// + 0.6 g, see option gain_echo.
double echoed_gain_percent(const FireSettings& fire, std::string_view gain_echo);

/// True if flag bit 4 leaves the gain to the device; option gain_assist states which value of the bit does, if any.
bool asks_for_gain_assist(const FireSettings& fire, std::string_view option);

/// Returns the row gains of option `row_gain: digital`. They are power gains, 10^((gain_db + 20 log r) / 10), limited to 1 to
/// 2^32 - 1; r is at least row_gain_from_m. 32-bit samples have no time-varied gain, so theirs are 10^(gain_db / 10).
std::vector<std::uint32_t> digital_row_gains(const PingSettings& settings);

/// True if a double in the message is NaN or infinite. Such a message must be ignored.
bool has_non_finite(const FireSettings& fire);
/// Returns the index into the model's modes; unknown modes count as 1.
int mode_index(const SonarModel& model, std::uint8_t wire_mode);

/// Returns the sound speed that the device computes if 0 is requested [m/s].
double device_sound_speed_mps(const protocol::DeviceState& device, double salinity_ppt);

/// The resulting settings, and a text for each clamped value.
struct ResolvedSettings {
  PingSettings settings;
  std::vector<std::string> clamped;
};
/// Converts a fire message, whose values must be finite.
ResolvedSettings resolve(const FireRequest& fire, const protocol::DeviceState& device);

/// Returns the size in bytes of a ping result with these settings.
std::size_t ping_size(const PingSettings& settings);

/// Returns a line for the log, such as "mode 2, range 20 m, gain 50 %, gamma 127, rate 10 Hz, sound speed of the device, 512
/// beams, 8 bits, ...".
std::string describe(const FireRequest& fire);

/// Converts an override to the fire message with which a driver would request the same settings; pings echo that message. Starts
/// with the current fire message and changes only the fields that are set in `wanted`. Refuses values that the product does not
/// support.
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

/// Returns the nearest of the rates that a fire message can request, except standby.
PingRate nearest_rate(double rate_hz);

}  // namespace sonar::oculus
