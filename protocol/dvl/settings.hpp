// The configuration that clients set, and the state that the device keeps between pings.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <tuple>

#include "core/base/geometry.hpp"
#include "core/sonar/range_image.hpp"
#include "core/sonar/sonar_model.hpp"
#include "protocol/held_settings.hpp"
#include "protocol/vendor.hpp"

namespace sonar::dvl {

// The products: beams, limits, range modes. Sources: protocol/dvl/README.md.

inline constexpr std::size_t beam_count = 4;
inline constexpr double tilt_rad = rad_from_deg(22.5);  // angle between a beam and the axis
/// Altitude above level ground divided by the distance along a beam.
inline const double altitude_per_distance = std::cos(tilt_rad);

struct Product {
  const char *profile, *name;
  std::uint16_t part_number;
  double centre_hz, beam_deg, source_level_db, highest_m, fastest_mps;
  double range_unit_m;  // unit of the ranges in the pixels of its pings
};
const Product& product_of(const SonarModel& model);
std::span<const std::shared_ptr<const SonarModel>> models();
/// Returns the model for a replay of this product. A device of this model makes no positions, because the recorded reports
/// contain them.
std::shared_ptr<const SonarModel> replayed_model(const SonarModel& recorded);

struct RangeMode {
  double lowest_m, highest_m;  // altitudes
  float rate_hz;
  double pulse_m;  // unknown: assumed
};
inline constexpr int range_mode_count = 5;
RangeMode range_mode(int index, const Product& product);

/// Returns the unit vector of a beam in the device's frame: x forward, y to starboard, z down.
Vec3d beam_direction(std::size_t beam);

/// A ping is computed as a range image of `grid_size` by `grid_size` directions about the device's axis; four of the directions
/// are beams.
inline constexpr int grid_size = 27;
/// Returns the index of a beam's pixel in Ping::samples.
std::size_t pixel_of(std::size_t beam);

/// Converts a vector from the sonar's axes (x ahead, z up) to the device's frame. The same formula converts back.
constexpr Vec3d device_from_sonar(Vec3d v) { return {v.z, -v.y, v.x}; }

/// Dead reckoning, in the vehicle's axes (x forward, y to starboard, z down) at the start of the reckoning.
struct Reckoning {
  bool is_started = false;
  Time at{};                  // time of the last ping
  Quatd first, last;          // vehicle in the world: at the start, and at the last ping
  Vec3d position_m;           // at the last ping
  Vec3d velocity_mps;         // since the last ping, in these axes
  double std_m = 0, fom = 0;  // fom: growth of std_m [m/s]
};

/// The reports on the serial line, by the numbers of the command that selects them.
enum class SerialOutput { none = 0, old_and_new = 1, new_ones = 3 };

struct Settings {
  double speed_of_sound_mps = 1475, mounting_rotation_deg = 0;
  bool acoustics = true, dark = false, cycles = true;
  std::string range_mode = "auto", ntp_address = "auto";
  SerialOutput serial_output = SerialOutput::old_and_new;    // unknown: assumed
  int lowest_mode = 0, highest_mode = range_mode_count - 1;  // allowed by range_mode
  bool is_triggered = false;                                 // true: a client has requested a ping while acoustics are off

  int mode = 2;  // range mode of the next ping
  Reckoning reckoning;

  /// Returns the values that clients set.
  auto configured() const {
    return std::tuple(speed_of_sound_mps, mounting_rotation_deg, acoustics, dark, cycles, range_mode, ntp_address, serial_output,
                      is_triggered);
  }
};
/// Pings with these settings are range images.
struct HeldSettings final : RangeImageSettings {
  HeldSettings(const Settings& s, const Product& product);
  bool equals(const VendorSettings& other) const override;
  std::shared_ptr<const PingFindings> look_at(const Ping& ping) const override;  // returns a Measurement (measure.cpp)
  Settings settings;
};
/// Returns the settings in `held`; if it is null, the settings of a new device.
inline Settings settings_from(const VendorSettings* held) { return protocol::settings_in<HeldSettings>(held); }

/// Sets the allowed modes from "auto", "=a" or "a<=b". Returns false if the text has another form.
bool allow_modes(std::string_view text, Settings& settings);
/// Returns the text of range_mode that allows all modes up to the first mode that reaches `range_m`.
std::string range_mode_for(double range_m, const Product& product);

PingSettings ping_settings(const Settings& settings, const Product& product);
protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device);
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

}  // namespace sonar::dvl
