// The Ping1D: the model, the checks of the settings, the automatic mode, and the frames of a ping. Sources:
// protocol/ping/README.md.
#pragma once

#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "protocol/held_settings.hpp"
#include "protocol/ping/echo.hpp"
#include "protocol/ping/ping1d_messages.hpp"
#include "protocol/vendor.hpp"

namespace sonar::ping::ping1d {

std::span<const std::shared_ptr<const SonarModel>> models();

inline constexpr int most_gain = 6;

struct Parameters {
  ScanRange range{0, 5000};
  std::uint32_t speed_mm_per_s = 1500000;
  std::uint16_t interval_ms = 100;
  std::uint8_t gain = 3, mode_auto = 1, enable = 1;
  bool operator==(const Parameters& other) const {
    const auto all = [](const Parameters& p) {
      return std::tuple(p.range.start_mm, p.range.length_mm, p.speed_mm_per_s, p.interval_ms, p.gain, p.mode_auto, p.enable);
    };
    return all(*this) == all(other);
  }
};
inline constexpr Results simple_result = 1, distance_result = 2, profile_result = 4;
inline Results results_of(Id id) {
  return id == Id::ping1d_distance_simple ? simple_result
         : id == Id::ping1d_distance      ? distance_result
         : id == Id::ping1d_profile       ? profile_result
                                          : no_result;
}

struct Settings {
  std::uint8_t id = 1;  // id of the device
  Parameters parameters;
  Results results = no_result;  // results that hosts requested; no_result: no host did, and the profile is sent
};
/// Compares settings without the results, which differ between pings.
bool same_settings(const Settings& a, const Settings& b);
/// Finds the echo.
inline std::shared_ptr<const PingFindings> findings_of(const Settings&, const Ping& ping) {
  return protocol::found(find_echo(ping));
}
using HeldSettings = protocol::Held<Settings>;
/// Returns the settings in `held`; if it is null, the settings of a new device.
inline Settings settings_from(const VendorSettings* held) { return protocol::settings_in<HeldSettings>(held); }

/// Returns the reason if the device refuses the parameters, else an empty text.
std::string complaint(const Parameters& parameters);
/// Returns the duration of the pulse with these parameters [us].
std::uint16_t transmit_us(const Parameters& parameters);
PingSettings ping_settings(const Settings& settings);
protocol::ChangeSettings change_to(const Settings& settings);
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

using ping::Echo;
using ping::find_echo;
/// Returns range and gain of the automatic mode after a ping in which `echo` was found.
Parameters adjusted(const Parameters& made_with, const Echo& echo);

/// Makes the frames for Settings::results, in the order of their message ids.
std::vector<Bytes> frames_of(const Ping& ping);
/// Makes the frames for the results `wanted` from a recorded frame. The recorded frame is returned unchanged if it is one of
/// them, or if `wanted` is no_result. A frame with more values than the recorded frame gets no samples, and 0 for the missing
/// values. Returns no frames if the recorded frame holds no result.
std::vector<Bytes> answer(BytesView recorded, Results wanted);

}  // namespace sonar::ping::ping1d
