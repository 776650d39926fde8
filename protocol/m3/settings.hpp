// Range, rate and gain, and the sampling window of a range. Only the M3's own program sets these values, not drivers.
#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "core/sonar/ping.hpp"
#include "core/sonar/ping_settings.hpp"
#include "core/sonar/sonar_model.hpp"
#include "protocol/held_settings.hpp"
#include "protocol/m3/messages.hpp"
#include "protocol/vendor.hpp"

namespace sonar::m3 {

// The product and its mode. Sources: protocol/m3/README.md.

inline constexpr int beam_count = 128;              // PKT
inline constexpr double beam_spacing_deg = 0.9375;  // PKT
inline constexpr double nearest_m = 0.2;            // PKT
inline constexpr double farthest_m = 150;           // recalled from the data sheet
inline constexpr float usual_rate_hz = 15;          // PKT
inline constexpr float highest_rate_hz = 40;        // recalled from the data sheet
inline constexpr double slowest_mps = 1400,
                        fastest_mps = 1560;  // sound speeds that a window covers; fitted to PKT, LOG

std::span<const std::shared_ptr<const SonarModel>> models();

inline constexpr double transmit_s = 25e-6;  // PKT: start of the pulse, from the start of the ping
/// unknown: limits of the gain law's c [dB]; the c of PKT is half way between them.
inline constexpr double least_c_db = -56, most_c_db = 24;

struct Settings {
  double far_m = 10;
  float rate_hz = usual_rate_hz;
  float c_db = GainLaw{}.c_db;
  bool operator==(const Settings&) const = default;
};
using HeldSettings = protocol::Held<Settings, PhasedSettings>;
/// Returns the settings in `held`; if it is null, the settings of a new device.
inline Settings settings_from(const VendorSettings* held) { return protocol::settings_in<HeldSettings>(held); }

/// Returns the near range that the program sets for a far range.
double near_of(double far_m);

/// The time in which the receiver samples; `start_s` counts from the start of the pulse.
struct Window {
  double start_s = 0, interval_s = 0;
  int samples = 0, pulse_us = 0;
};
Window window_of(double near_m, double far_m);

PingSettings ping_settings(const Settings& settings, const protocol::DeviceState& device);
protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device);
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);
double gain_percent(const Settings& settings);

/// Options of a sonar in the configuration, by name, under `options:`.
namespace option_name {
inline constexpr std::string_view positive_angles = "positive_angles";
}
std::span<const protocol::Option> options();

}  // namespace sonar::m3
