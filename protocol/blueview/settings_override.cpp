#include "protocol/blueview/settings_override.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "protocol/blueview/head_settings.hpp"
#include "protocol/blueview/models.hpp"
#include "protocol/limits.hpp"

namespace sonar::blueview {
namespace {

constexpr double half_gain_db = 48;  // assumed: 0 to 100 % are -48 to 48 dB, a span like that of an Oculus

constexpr double least_window_m = 0.01;

tl::unexpected<Error> refused(std::string text) { return failure(ErrorKind::usage, std::move(text)); }

Result<void> set(SonarSettings& all, Key key, const Value& value, const protocol::DeviceState& device) {
  const Applied applied = apply(all, all.active_head, key, value, device);
  if (!applied.value) return refused(applied.refusal.text);
  return {};
}

Result<void> set_range(SonarSettings& all, double range_m, const protocol::DeviceState& device) {
  const FrequencyMode& mode = device.model->modes[static_cast<std::size_t>(all.active_head)];
  const double start_m = static_cast<double>(all.heads[static_cast<std::size_t>(all.active_head)].start_m);
  const std::string why = protocol::range_complaint(range_m, device.model->name + " with this head",
                                                    std::max(start_m + least_window_m, static_cast<double>(mode.min_range_m)),
                                                    static_cast<double>(mode.max_range_m), "stop_range");
  if (!why.empty()) return refused(why);
  return set(all, Key::stop_range, static_cast<float>(range_m), device);
}

Result<void> set_rate(SonarSettings& all, double rate_hz, const protocol::DeviceState& device) {
  if (rate_hz < 0) return refused("a ping rate must be above 0");
  if (rate_hz == 0)
    return refused("BlueView sonars have no standby: they ping when a host asks; to silence one, set transmit: false");
  return set(all, Key::ping_interval, ping_interval_ms(rate_hz), device);
}

}  // namespace

std::int32_t ping_interval_ms(double rate_hz) {
  return static_cast<std::int32_t>(std::clamp(std::round(1000 / rate_hz), 1.0, 3600e3));
}

float gain_db_from(double percent) { return static_cast<float>(half_gain_db * (percent / 50 - 1)); }

double gain_percent_from(double gain_db) { return 50 * (gain_db / half_gain_db + 1); }

// SET clamps a range that is not possible. An override refuses such a range, and its error states the limits of the product
// (Vendor::apply_override).
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  SonarSettings all = settings_from(device.settings.get(), device);
  if (wanted.mode) {
    if (*wanted.mode >= all.heads.size())
      return refused(device.model->name + " has " + std::to_string(all.heads.size()) +
                     " mode(s), one per head, counted from 0; no mode " + std::to_string(*wanted.mode));
    all.active_head = static_cast<std::int32_t>(*wanted.mode);
  }
  if (wanted.range_m)
    if (auto r = set_range(all, *wanted.range_m, device); !r) return tl::make_unexpected(r.error());
  if (wanted.rate_hz)
    if (auto r = set_rate(all, *wanted.rate_hz, device); !r) return tl::make_unexpected(r.error());
  if (const std::string why = protocol::gain_complaint(wanted); !why.empty()) return refused(why);
  if (wanted.gain_percent) {
    if (auto r = set(all, Key::gain, gain_db_from(*wanted.gain_percent), device); !r) return tl::make_unexpected(r.error());
  }
  if (wanted.beams) {
    const auto beams = static_cast<std::uint32_t>(ping_settings(all, device).beam_count);
    if (*wanted.beams != beams)
      return refused(device.model->name + " forms " + std::to_string(beams) + " beams with this head, not " +
                     std::to_string(*wanted.beams));
  }
  if (wanted.sample_bits && *wanted.sample_bits != 16)
    return refused("BlueView sonars send samples of 16 bits, not of " + std::to_string(*wanted.sample_bits));
  if (wanted.row_gains && *wanted.row_gains) return refused("BlueView sonars send no row gains");
  return protocol::ChangeSettings{ping_settings(all, device), std::make_shared<SonarSettings>(all), describe(all, device)};
}

}  // namespace sonar::blueview
