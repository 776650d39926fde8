// The settings that clients have made over HTTP, and their conversion to PingSettings.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/sonar/range_image.hpp"
#include "protocol/vendor.hpp"
#include "protocol/waterlinked/models.hpp"

namespace sonar::waterlinked {

inline constexpr std::string_view multicast = "multicast", unicast = "unicast", disabled = "disabled";
inline constexpr protocol::Endpoint multicast_group{{224, 0, 0, 96}, 4747};

struct Settings {
  bool acoustics = false;
  double range_min_m = 0, range_max_m = longest_range_m;
  double speed_of_sound_mps = 0;  // 0 = from temperature and salinity
  std::size_t mode = 0;           // index into mode_rows()
  bool fresh = false;
  std::string udp{disabled}, unicast_ip;
  std::uint16_t unicast_port = 0;
  bool imu = false;
  std::string ntp_address = "auto";
  std::chrono::nanoseconds clock_offset{0};  // offset of the device's clock while it is not synchronised
  double rate_hz = 0;                        // 0 = the mode's
  bool operator==(const Settings&) const = default;
};
/// Pings with these settings are range images.
struct HeldSettings final : RangeImageSettings {
  explicit HeldSettings(const Settings& s);
  bool equals(const VendorSettings& other) const override;
  Settings settings;
};
Settings initial_settings(const protocol::DeviceState& device);
/// The settings in `held`; if it is null, initial_settings().
Settings settings_from(const VendorSettings* held, const protocol::DeviceState& device);

PingSettings ping_settings(const Settings& settings, const protocol::DeviceState& device);
protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device);
/// The receivers of the images: none while UDP output is disabled.
protocol::SetReceivers receivers_of(const Settings& settings);

/// The time of the device's clock.
Time device_time(Time at, const Settings& settings, const protocol::DeviceState& device);

Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

/// Options of a sonar in the configuration, under `options:`: properties that the public sources do not state.
namespace option_name {
inline constexpr std::string_view release = "release", rip = "rip", acoustics_at_start = "acoustics_at_start",
                                  udp_at_start = "udp_at_start", clock = "clock";
}
std::span<const protocol::Option> options();
using protocol::text_option;

}  // namespace sonar::waterlinked
