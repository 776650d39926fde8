// Checks the acoustic settings that a controller sends to an ARIS, limits them as the device does, and converts them to
// PingSettings. docs/protocols/aris.md has the formulas and sources.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/sonar/ping_settings.hpp"
#include "protocol/aris/models.hpp"
#include "protocol/held_settings.hpp"
#include "protocol/vendor.hpp"

namespace sonar::aris {

inline constexpr double highest_rate_hz = 15, highest_gain_db = 24;
inline constexpr std::uint32_t least_samples = 128, most_samples = 4096;  // per beam
inline constexpr std::uint32_t shortest_period_us = 4;

/// All values that a controller has set. They are kept in addition to PingSettings, because the headers of frames repeat them.
struct Settings {
  Acoustics acoustics;
  bool valid = false;                                       // true: a SET_ACOUSTICS was accepted
  bool streaming = false;                                   // true: a receiver is set
  std::uint32_t applied = 0, constrained = 0, invalid = 0;  // the last cookie of each kind
  std::uint32_t salinity = 35;                              // 0, 15, 35, as SET_SALINITY sets it
  bool telephoto = false;
  std::uint32_t focus_from = 0, focus_to = 0;  // 0 to 1000
  Time focus_set_at{};
  bool delays_packets = false;
  std::uint32_t packet_delay_us = 0;
  std::chrono::nanoseconds clock_offset{0};  // from SET_DATETIME, added to the device's clock
  std::uint32_t first_ping = 0;              // number of the last ping before the controller connected
  bool operator==(const Settings&) const = default;
};
using HeldSettings = protocol::Held<Settings>;
Settings initial_settings(const protocol::DeviceState& device);
/// Returns the settings in `held`; if it is null, initial_settings().
Settings settings_from(const VendorSettings* held, const protocol::DeviceState& device);

/// Returns the sound speed [m/s] for the temperature and depth of the water at the device, and the salinity that was set.
double sound_speed_mps(double temperature_c, double salinity_psu, double depth_m);

/// Returns the highest frame rate with these settings, 1 to 15 [Hz].
double highest_frame_rate_hz(const Product& product, const Acoustics& acoustics, std::optional<std::uint32_t> packet_delay_us);

/// Returns the shortest cycle period that the device accepts: start delay, all samples, and a pause of 360 us [us].
std::uint32_t shortest_cycle_us(const Acoustics& acoustics);

/// The device's answer to a SET_ACOUSTICS.
struct Verdict {
  std::string refusal;  // empty = valid
  Acoustics used;
  bool constrained = false;
};
Verdict judge(const Acoustics& asked, const Product& product, bool lenient_cycle,
              std::optional<std::uint32_t> packet_delay_us = std::nullopt);
/// Calls judge() and writes its result into `settings`: the cookie as applied, constrained or invalid, and, unless the request
/// was refused, the acoustic settings that the device uses.
Verdict apply(Settings& settings, const Acoustics& asked, const protocol::DeviceState& device);

/// Returns the position of the focus motor for a range: 0 at the sonar, 1000 at the end of the product's longest window.
std::uint32_t focus_position(double range_m, const Product& product);
/// Position of the focus motor at one time. The motor needs one second from 0 to 1000.
struct FocusNow {
  std::uint32_t position = 0;
  bool moves = false;
};
FocusNow focus_at(const Settings& settings, Time at);

PingSettings ping_settings(const Settings& settings, const protocol::DeviceState& device);
protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device);

/// Returns the change that a SET_ACOUSTICS with the override's values would cause.
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

/// Options of a sonar in the configuration, under `options:`: properties that the public sources do not state.
namespace option_name {
inline constexpr std::string_view cycle = "cycle", reordered = "reordered", receivers = "receivers", silence_s = "silence_s",
                                  header_bytes = "header_bytes", datagram_bytes = "datagram_bytes";
}
std::span<const protocol::Option> options();
using protocol::number_option;
using protocol::text_option;

}  // namespace sonar::aris
