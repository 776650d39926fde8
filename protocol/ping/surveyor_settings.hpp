// The Surveyor 240: its SonarModel, the checks of its settings, and the frames of a ping. Pure functions; sources:
// docs/protocols/ping.md.
#pragma once

#include <optional>
#include <vector>

#include "protocol/held_settings.hpp"
#include "protocol/ping/messages.hpp"
#include "protocol/vendor.hpp"

namespace sonar::ping::surveyor {

std::span<const std::shared_ptr<const SonarModel>> models();

/// The settings that a host has made.
struct Settings {
  std::uint8_t id = 0;  // id of the device; its value in a new device is unknown
  PingParameters parameters;
  std::optional<std::chrono::nanoseconds> utc_ahead;  // offset of the device's clock, once a host has set it
};
/// Clock offsets that differ by less than a millisecond count as equal.
bool same_settings(const Settings& a, const Settings& b);
/// Returns the detected points of the ping, as a std::vector<Detection>.
std::shared_ptr<const PingFindings> findings_of(const Settings& settings, const Ping& ping);
using HeldSettings = protocol::Held<Settings>;
/// Returns the settings in `held`; if it is null, the settings of a new device.
inline Settings settings_from(const VendorSettings* held) { return protocol::settings_in<HeldSettings>(held); }

/// The reason if the device refuses the parameters, else an empty text.
std::string complaint(const PingParameters& parameters);
PingSettings ping_settings(const Settings& settings);
protocol::ChangeSettings change_to(const Settings& settings);
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

WaterStats water_stats(const protocol::DeviceState& device);
/// The frames in the order in which they are sent: 504, then 3012 and 3011 if the settings enable them, and once a second 118.
std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState& device);

}  // namespace sonar::ping::surveyor
