// The settings that clients have set over HTTP, and their conversion to PingSettings.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "core/sonar/range_image.hpp"
#include "core/sonar/sonar_model.hpp"
#include "protocol/vendor.hpp"

namespace sonar::waterlinked {

// The Sonar 3D-15 as a SonarModel with two modes, and the constants of its images. Sources: docs/protocols/waterlinked.md.

inline constexpr int columns = 256, rows = 64;
inline constexpr double longest_range_m = 15, least_window_m = 0.1, pixel_scale_m = 50.0 / 65536;
inline constexpr std::uint32_t full_scale_strength = 400;  // linear; the assisted gain keeps 99 % of the pixels below 80 % of it

/// Properties of the device in SMP, a recording; fitted to its shots 1 to 3, confirmed with shots 4 to 6 (likeness_test.cpp).
/// Half of the ranges equal that of a neighbour, more often at strong returns, because beams in which the same scatterer is the
/// strongest report its range. In neighbouring rows the strengths have a correlation of 0.59, and half of the ranges are equal.
/// Across the edges of four blocks of 16 rows the correlation is 0.09 to 0.20, and 1 to 7 % of the ranges are equal.
inline constexpr bool range_of_loudest = true;
inline constexpr int block_rows = 16;
/// 69 % of the pixels have the median of their range and those of eight neighbours; 3 % have the largest or the smallest.
inline constexpr int median_passes = 1;
/// The device drops returns that no neighbour confirms. Where the ranges around a pixel span less than 4 mm, 0.3 % of the pixels
/// have no return; 16 to 64 mm: 4 %, more: 8 %. The strength of the neighbours has no influence. Fitted on rough slopes.
inline constexpr int least_confirming = 1;
inline constexpr double confirming_m = 0.007;
/// Most ranges in SMP are multiples of this range.
inline constexpr double range_sample_m = 1.0 / 640;

/// Values of a mode in addition to FrequencyMode.
struct ModeRow {
  const char* name = "";  // the name in the HTTP API
  double centre_hz = 0, horizontal_deg = 0, vertical_deg = 0, beam_width_deg = 0, beam_height_deg = 0, range_cell_m = 0;
  float rate_hz = 0;
};
std::span<const ModeRow> mode_rows();
std::span<const std::shared_ptr<const SonarModel>> models();

inline constexpr std::string_view multicast = "multicast", unicast = "unicast", disabled = "disabled";
inline constexpr protocol::Endpoint multicast_group{{224, 0, 0, 96}, 4747};

struct Settings {
  bool acoustics = false;
  double range_min_m = 0, range_max_m = longest_range_m;
  double speed_of_sound_mps = 0;  // 0 = computed from temperature and salinity
  std::size_t mode = 0;           // index into mode_rows()
  bool fresh = false;
  std::string udp{disabled}, unicast_ip;
  std::uint16_t unicast_port = 0;
  bool imu = false;
  std::string ntp_address = "auto";
  std::chrono::nanoseconds clock_offset{0};  // offset of the device's clock while it is not synchronised
  double rate_hz = 0;                        // 0 = the rate of the mode
  bool operator==(const Settings&) const = default;
};
/// Pings with these settings are range images.
struct HeldSettings final : RangeImageSettings {
  explicit HeldSettings(const Settings& s);
  bool equals(const VendorSettings& other) const override;
  Settings settings;
};
Settings initial_settings(const protocol::DeviceState& device);
/// Returns the settings in `held`; if it is null, initial_settings().
Settings settings_from(const VendorSettings* held, const protocol::DeviceState& device);

PingSettings ping_settings(const Settings& settings, const protocol::DeviceState& device);
protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device);
/// Returns the receivers of the images; none while UDP output is disabled.
protocol::SetReceivers receivers_of(const Settings& settings);

/// Returns the time of the device's clock.
Time device_time(Time at, const Settings& settings, const protocol::DeviceState& device);

Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

/// Options of a sonar in the configuration (`options:`), for properties that the public sources do not state.
namespace option_name {
inline constexpr std::string_view release = "release", rip = "rip", acoustics_at_start = "acoustics_at_start",
                                  udp_at_start = "udp_at_start", clock = "clock";
}
std::span<const protocol::Option> options();
using protocol::text_option;

}  // namespace sonar::waterlinked
