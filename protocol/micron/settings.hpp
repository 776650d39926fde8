// The Micron: the model, the checks of the settings, the scan of the head, and the message of a ping. Sources:
// docs/protocols/micron.md.
#pragma once

#include <string>

#include "protocol/held_settings.hpp"
#include "protocol/micron/messages.hpp"
#include "protocol/vendor.hpp"

namespace sonar::micron {

namespace option_name {
inline constexpr std::string_view lines = "lines_per_request", first_bin = "first_4bit_bin", link_rate = "link_rate";
}
std::span<const protocol::Option> options();
std::span<const std::shared_ptr<const SonarModel>> models();

inline constexpr int turn = 6400;   // 1/16 grad
inline constexpr int ahead = 3200;  // also the centre of the scan
inline constexpr double bin_unit_s = 640e-9;
inline constexpr int most_gain = 210;

struct Settings {
  HeadCommand command;
  bool has_parameters = false;    // true: a host has sent the command since the last reboot
  std::uint16_t bearing = ahead;  // bearing of the present ping
};
/// Compares settings without the bearing, which changes with every ping.
bool same_settings(const Settings& a, const Settings& b);
using HeldSettings = protocol::Held<Settings>;
/// Returns the settings in `held`; if it is null, the settings of a new device.
inline Settings settings_from(const VendorSettings* held) { return protocol::settings_in<HeldSettings>(held); }

/// Returns the longest interval, in units of 640 ns, that complaint() accepts for this number of bins.
int longest_interval(int bins);
/// Returns the reason if the device ignores the command, else an empty text.
std::string complaint(const HeadCommand& command);
PingSettings ping_settings(const Settings& settings, const protocol::DeviceState& device);
protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device);
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

/// Returns the angle [rad], positive to port, between the sonar's forward axis and the direction of the head.
double head_rad(const Settings& settings);
/// listening() returns the duration of a ping's bins, transfer() the time to send the scan line, turning() the time to turn.
std::chrono::nanoseconds listening(const HeadCommand& command);
std::chrono::nanoseconds transfer(const HeadCommand& command, const protocol::OptionValues& options);
std::chrono::nanoseconds turning(int sixteenths);

/// The bearing of the head, and the direction of the scan. A sector is the part from the left limit clockwise to the right limit.
struct Scan {
  int bearing = ahead;
  bool to_right = true;
  /// Turns the head into the sector of a new command. Returns the rotation in 1/16 grad, positive to the right.
  int begin(const HeadCommand& command);
  /// Turns the head to the bearing of the next ping. Returns the rotation in 1/16 grad, positive to the right.
  int advance(const HeadCommand& command);
};
/// Returns HeadData::sweep: 0 within a scan, 1 at its left limit, 2 at its right limit.
std::uint8_t sweep_code(const HeadCommand& command, int bearing);

/// Makes the message mtHeadData for a ping.
Bytes encode(const Ping& ping, const protocol::DeviceState& device);

std::optional<protocol::Field> locate(protocol::FieldName name, BytesView frame);
std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, BytesView frame);

}  // namespace sonar::micron
