// The Omniscan 450: the model, the checks of the settings, and the frame of a ping. Sources: docs/protocols/ping.md.
#pragma once

#include "protocol/held_settings.hpp"
#include "protocol/ping/omniscan_messages.hpp"
#include "protocol/vendor.hpp"

namespace sonar::ping::omniscan {

std::span<const std::shared_ptr<const SonarModel>> models();

/// The settings that a host has set.
struct Settings {
  std::uint8_t id = 0;  // id of the device; unknown: the id of a new device
  OsPingParams parameters;
  float speed_mps = 1500;
  bool operator==(const Settings&) const = default;
};
using HeldSettings = protocol::Held<Settings>;
/// Returns the settings in `held`; if it is null, the settings of a new device.
inline Settings settings_from(const VendorSettings* held) { return protocol::settings_in<HeldSettings>(held); }

/// Returns the reason if the device refuses the parameters, else an empty text.
std::string complaint(const OsPingParams& parameters);
PingSettings ping_settings(const Settings& settings);
protocol::ChangeSettings change_to(const Settings& settings);
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

/// Encodes a ping as message 2198.
Bytes profile_of(const Ping& ping, const protocol::DeviceState& device);

}  // namespace sonar::ping::omniscan
