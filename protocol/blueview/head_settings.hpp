// Checks the settings of a sonar's heads and converts them to PingSettings. All hosts of a sonar share one set, which the device
// stores.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/sonar/ping_settings.hpp"
#include "protocol/blueview/frames.hpp"
#include "protocol/vendor.hpp"

namespace sonar::blueview {

struct HeadSettings {
  float start_m = 2, stop_m = 10;
  std::int32_t sound_speed_mps = 1500;
  float gain_db = 0;
  float tvg_db_per_m = 0;
  std::int32_t fluid = 0;  // 0 = salt, 1 = fresh, 2 = other
  std::int32_t transmit = 1;
  std::int32_t ping_interval_ms = 0;  // 0 = a ping whenever a host requests it
  std::int32_t dynamic_power = 0;     // stored and returned; no effect
  float source_level_db = 0;          // stored and returned; no effect
  bool operator==(const HeadSettings&) const = default;
};

/// Settings of the whole sonar.
struct SonarSettings final : VendorSettings {
  bool equals(const VendorSettings& other) const override;

  std::int32_t active_head = 0;  // index of the head that pings next
  std::int32_t local_clock = 0;  // stored and returned; no effect
  std::string name;
  std::vector<HeadSettings> heads;
};
SonarSettings initial_sonar_settings(const protocol::DeviceState& device);
/// Returns the settings in `settings`; if it is null, initial_sonar_settings().
SonarSettings settings_from(const VendorSettings* settings, const protocol::DeviceState& device);

struct Refusal {
  Code code{};
  std::string text;
};
struct Applied {
  std::optional<Value> value;
  Refusal refusal;  // set if there is no value
};
/// Sets one key of a head and returns the applied value, which is the nearest valid one. Refuses an unusable value and, with
/// strict_range, a range outside the limits.
Applied apply(SonarSettings& settings, int head, Key key, const Value& value, const protocol::DeviceState& device);
std::optional<Value> read_back(const SonarSettings& settings, int head, Key key);

/// The sample grid of a head. Rows count from the sonar; the first `skipped` rows are before the start range.
struct HeadGrid {
  double bin_m = 0;
  int skipped = 0, bins = 0;
  double row_centre = 0.5;
};
HeadGrid grid_of(const HeadSettings& head, double finest_bin_m);

PingSettings ping_settings(const SonarSettings& settings, const protocol::DeviceState& device);

/// Returns one line for the log.
std::string describe(const SonarSettings& settings, const protocol::DeviceState& device);

/// Options of a sonar in the configuration, by name, under `options:`.
namespace option_name {
inline constexpr std::string_view heads_base = "heads_base", strict_range = "strict_range", compression = "compression";
}
std::span<const protocol::Option> options();
using protocol::text_option;

/// Converts between per cent and the gain adjustment [dB]: 0 % is -48 dB, 100 % is 48 dB.
float gain_db_from(double percent);
double gain_percent_from(double gain_db);

/// Returns the interval between pings, limited to the range from 1 ms to one hour. `rate_hz` must be above 0.
std::int32_t ping_interval_ms(double rate_hz);

/// Converts an override to the settings that a host would set: selects the head `wanted.mode`, if it is set, then changes the
/// other set fields on the active head. Refuses values that the product does not support.
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

}  // namespace sonar::blueview
