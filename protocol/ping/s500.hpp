// The S500: the model, the checks of the settings, the mean of the distances, and the frames of a ping. Sources:
// protocol/ping/README.md.
#pragma once

#include <string>
#include <vector>

#include "protocol/held_settings.hpp"
#include "protocol/ping/echo.hpp"
#include "protocol/ping/s500_messages.hpp"
#include "protocol/vendor.hpp"

namespace sonar::ping::s500 {

std::span<const std::shared_ptr<const SonarModel>> models();

struct Parameters {
  SetPingParams ping;              // requested parameters
  Reach reach{.length_mm = 5000};  // present range from start_mm on, and gain; requested or chosen by the device
  std::uint32_t speed_mm_per_s = 1500000;
  std::uint8_t enable = 1;
};

inline constexpr Results altitude_result = 1, distance_result = 2, profile_result = 4;
inline Results results_of(Id id) {
  return id == Id::ping1d_distance_simple ? altitude_result
         : id == Id::s500_distance2       ? distance_result
         : id == Id::s500_profile6        ? profile_result
                                          : no_result;
}

struct Settings {
  std::uint8_t id = 0;  // id of the device; unknown: the id of a new device
  Parameters parameters;
  Results results = no_result;  // results that hosts requested; no_result: no host did, and the profile is sent
  std::vector<Echo> earlier;    // echoes of earlier pings, the newest last
};
/// Compares settings without the results and the echoes, which differ between pings.
bool same_settings(const Settings& a, const Settings& b);
/// Finds the echo.
inline std::shared_ptr<const PingFindings> findings_of(const Settings&, const Ping& ping) {
  return protocol::found(find_echo(ping));
}
using HeldSettings = protocol::Held<Settings>;
/// Returns the settings in `held`; if it is null, the settings of a new device.
inline Settings settings_from(const VendorSettings* held) { return protocol::settings_in<HeldSettings>(held); }

/// Returns the reason if the device refuses the request, else an empty text.
std::string complaint(const SetPingParams& wanted);
/// Returns the parameters after the request.
Parameters requested(const Parameters& before, const SetPingParams& wanted);
/// Returns the interval between pings: the requested one, but at least 100 ms.
int interval_ms(const Parameters& parameters);
PingSettings ping_settings(const Settings& settings);
protocol::ChangeSettings change_to(const Settings& settings);
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);
double gain_percent(const Parameters& parameters);

/// Returns the settings `now`, changed by the automatic range and gain after a ping. The ping may have been made with earlier
/// settings.
Settings after(const Ping& ping, const Settings& now);
/// Makes the frames for Settings::results: altitude, distance, profile.
std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState& device);
/// Does the same as ping1d::answer().
std::vector<Bytes> answer(BytesView recorded, Results wanted);

}  // namespace sonar::ping::s500
