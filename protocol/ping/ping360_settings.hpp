// The Ping360: the model, the checks of the settings, their conversion to PingSettings, and the turning of the head. Sources:
// docs/protocols/ping.md.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "protocol/held_settings.hpp"
#include "protocol/ping/messages.hpp"
#include "protocol/vendor.hpp"

namespace sonar::ping::ping360 {

inline constexpr int grads = 400;  // grads in a turn

namespace option_name {
inline constexpr std::string_view firmware = "firmware", mount_grad = "mount_grad", sector_scan = "sector_scan",
                                  link_rate = "link_rate";
}
std::span<const protocol::Option> options();
std::span<const std::shared_ptr<const SonarModel>> models();

/// The settings that a host has set; pings echo them. `ping.angle` is the direction of the head.
struct Settings {
  std::uint8_t id = 2;  // id of the device
  Transducer ping;
  bool scans = false;  // true: the request was auto_transmit (2602), whose other fields follow
  std::uint16_t start = 0, stop = 399;
  std::uint8_t steps = 1, delay_ms = 0;
};
/// Compares settings without the id of the device, and without the angle, which changes with every ping.
bool same_settings(const Settings& a, const Settings& b);
using HeldSettings = protocol::Held<Settings>;
/// Returns the settings in `held`; if it is null, the settings of a new device.
inline Settings settings_from(const VendorSettings* held) { return protocol::settings_in<HeldSettings>(held); }

/// Returns the reason if the device refuses the request, else an empty text.
std::string complaint(const Transducer& t);
std::string complaint(const AutoTransmit& t);
Settings settings_of(const Transducer& t);
Settings settings_of(const AutoTransmit& t);

PingSettings ping_settings(const Settings& settings, const protocol::DeviceState& device);
protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device);
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

/// Makes the message of a ping with these settings: auto_device_data in a scan, else device_data.
Bytes encode(const Settings& settings, BytesView samples);
struct Line {
  Transducer ping;
  Bytes samples;
};
/// Reads the scan line in such a message; returns nullopt if it is another or incomplete, has no samples or a wrong checksum.
std::optional<Line> line_in(BytesView message);

/// Returns the angle [rad] by which the sonar is rotated to port, so that it points in the direction of the head. Angles of the
/// head increase to starboard.
double head_rad(std::uint16_t angle, const protocol::OptionValues& options);
/// Returns the duration of the samples of a ping.
std::chrono::nanoseconds listening(const Transducer& t);
/// Returns the time to send a ping's answer over the link.
std::chrono::nanoseconds transfer(const Transducer& t, const protocol::OptionValues& options);

/// The position of a turning head. It turns by the smaller angle, at 6 ms per grad.
struct Head {
  int from = 0, to = 0;  // grad; `to` may be beyond a turn
  Time since{};
  Time arrives() const;
  std::uint16_t target() const { return static_cast<std::uint16_t>((to % grads + grads) % grads); }
  std::uint16_t angle_at(Time at) const;
  /// Begins a turn at the time `at`, from the angle that the head then has.
  void turn_to(std::uint16_t angle, Time at);
};

/// Returns the angle after `angle` in a scan. `back`: true while the scan returns; the caller keeps it between calls.
/// `oscillates`: option sector_scan.
std::uint16_t next_angle(std::uint16_t angle, const Settings& scan, bool& back, bool oscillates);

}  // namespace sonar::ping::ping360
