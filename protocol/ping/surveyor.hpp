// The Surveyor 240: the SonarModel, the checks of the settings, and the frames of a ping. Sources: docs/protocols/ping.md.
#pragma once

#include <optional>
#include <vector>

#include "protocol/held_settings.hpp"
#include "protocol/ping/messages.hpp"
#include "protocol/vendor.hpp"

namespace sonar::ping::surveyor {

std::span<const std::shared_ptr<const SonarModel>> models();

/// The settings that a host has set.
struct Settings {
  std::uint8_t id = 0;  // id of the device; unknown: the id of a new device
  PingParameters parameters;
  std::optional<std::chrono::nanoseconds> utc_ahead;  // offset of the device's clock, once a host has set it
};
/// Compares settings; clock offsets that differ by less than a millisecond count as equal.
bool same_settings(const Settings& a, const Settings& b);
/// Returns the detected points of the ping; they hold a std::vector<Detection>.
std::shared_ptr<const PingFindings> findings_of(const Settings& settings, const Ping& ping);
using HeldSettings = protocol::Held<Settings>;
/// Returns the settings in `held`; if it is null, the settings of a new device.
inline Settings settings_from(const VendorSettings* held) { return protocol::settings_in<HeldSettings>(held); }

/// Returns the reason if the device refuses the parameters, else an empty text.
std::string complaint(const PingParameters& parameters);
PingSettings ping_settings(const Settings& settings);
protocol::ChangeSettings change_to(const Settings& settings);
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

WaterStats water_stats(const protocol::DeviceState& device);
/// Returns the frames in the order of sending: attitude_report (504), then atof_point_data (3012) and yz_point_data (3011) if the
/// settings enable them, and once per second water_stats (118).
std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState& device);

}  // namespace sonar::ping::surveyor
