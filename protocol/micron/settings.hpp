// The laws of a Micron: its product, its settings, where its head goes, and the message of a ping. Pure functions; sources:
// docs/protocols/micron.md.
#pragma once

#include <string>

#include "protocol/held_settings.hpp"
#include "protocol/micron/messages.hpp"
#include "protocol/options.hpp"
#include "protocol/vendor.hpp"

namespace sonar::micron {

namespace option_name {
inline constexpr std::string_view lines = "lines_per_request", first_bin = "first_4bit_bin", link_rate = "link_rate";
}
std::span<const protocol::Option> options();
std::span<const std::shared_ptr<const SonarModel>> models();

inline constexpr int turn = 6400;   // 1/16 grad
inline constexpr int ahead = 3200;  // and centre
inline constexpr double bin_unit_s = 640e-9;
inline constexpr int most_gain = 210;

struct Settings {
  HeadCommand command;
  bool has_parameters = false;    // a host has sent the command since the last reboot
  std::uint16_t bearing = ahead;  // of a ping
};
/// But for the bearing, which changes with every ping.
bool same_settings(const Settings& a, const Settings& b);
using HeldSettings = protocol::Held<Settings>;
/// The settings of a new device, for null.
inline Settings settings_from(const VendorSettings* held) { return protocol::settings_in<HeldSettings>(held); }

/// Why the device ignores it; empty = it does not.
std::string complaint(const HeadCommand& command);
PingSettings ping_settings(const Settings& settings, const protocol::DeviceState& device);
protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device);
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

/// How far the sonar is turned to port for the head to look there.
double head_rad(const Settings& settings);
/// Time the bins of a ping take, and its answer on its link.
std::chrono::nanoseconds listening(const HeadCommand& command);
std::chrono::nanoseconds transfer(const HeadCommand& command, const protocol::OptionValues& options);
std::chrono::nanoseconds turning(int sixteenths);

/// Where a scan goes. A sector is the part from the left limit clockwise to the right one.
struct Scan {
  int bearing = ahead;
  bool to_right = true;
  /// Into the sector, as a new command demands. Returns the way, in 1/16 grad.
  int begin(const HeadCommand& command);
  /// To the next ping's bearing; likewise.
  int advance(const HeadCommand& command);
};
/// HeadData::sweep: 0 within a scan, 1 at its left limit, 2 at its right one.
std::uint8_t sweep_code(const HeadCommand& command, int bearing);

/// mtHeadData of a ping.
Bytes encode(const Ping& ping, const protocol::DeviceState& device);

std::optional<protocol::Field> locate(protocol::FieldName name, BytesView frame);
std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, BytesView frame);

}  // namespace sonar::micron
