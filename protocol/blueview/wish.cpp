#include "protocol/blueview/wish.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "protocol/blueview/head_settings.hpp"
#include "protocol/blueview/models.hpp"

namespace sonar::blueview {
namespace {

constexpr double half_gain_db = 48;  // chosen: 0 to 100 % turn the gain adjustment from -48 to 48 dB, as an Oculus' 96 dB

tl::unexpected<Error> refused(std::string text) { return failure(ErrorKind::usage, std::move(text)); }

Result<void> set(SonarSettings& all, Key key, const Value& value, const protocol::DeviceState& device) {
  const Applied applied = apply(all, all.active_head, key, value, device);
  if (!applied.value) return refused(applied.refusal.text);
  return {};
}

Result<void> set_range(SonarSettings& all, double range_m, const protocol::DeviceState& device) {
  const FrequencyMode& mode = device.model->modes[static_cast<std::size_t>(all.active_head)];
  const double start_m = static_cast<double>(all.heads[static_cast<std::size_t>(all.active_head)].start_m);
  if (range_m <= std::max(start_m, static_cast<double>(mode.min_range_m)) || range_m > static_cast<double>(mode.max_range_m)) {
    char text[192];
    std::snprintf(text, sizeof text, "%s sees from %g to %g m with this head, and starts at %g m now; %g m is no range of it",
                  device.model->name.c_str(), static_cast<double>(mode.min_range_m), static_cast<double>(mode.max_range_m),
                  start_m, range_m);
    return refused(text);
  }
  return set(all, Key::stop_range, static_cast<float>(range_m), device);
}

Result<void> set_rate(SonarSettings& all, double rate_hz, const protocol::DeviceState& device) {
  if (rate_hz < 0) return refused("a ping rate must be above 0");
  if (rate_hz == 0) return refused("BlueView sonars have no standby: they ping when a host asks; transmit: false silences one");
  const double interval_ms = std::max(1.0, std::round(1000 / rate_hz));
  return set(all, Key::ping_interval, static_cast<std::int32_t>(std::min(interval_ms, 3600e3)), device);
}

}  // namespace

float gain_db_from(double percent) { return static_cast<float>(half_gain_db * (percent / 50 - 1)); }

Result<protocol::ChangeSettings> wished(const protocol::Wish& wish, const protocol::DeviceState& device) {
  SonarSettings all = settings_from(device.request, device);
  if (wish.mode) {
    if (*wish.mode >= all.heads.size())
      return refused(device.model->name + " has " + std::to_string(all.heads.size()) +
                     " mode(s), one a head, counted from 0; there is no mode " + std::to_string(*wish.mode));
    all.active_head = static_cast<std::int32_t>(*wish.mode);
  }
  if (wish.range_m)
    if (auto r = set_range(all, *wish.range_m, device); !r) return tl::make_unexpected(r.error());
  if (wish.rate_hz)
    if (auto r = set_rate(all, *wish.rate_hz, device); !r) return tl::make_unexpected(r.error());
  if (wish.gain_percent) {
    if (*wish.gain_percent < 0 || *wish.gain_percent > 100) return refused("gain_percent must be from 0 to 100");
    if (auto r = set(all, Key::gain, gain_db_from(*wish.gain_percent), device); !r) return tl::make_unexpected(r.error());
  }
  if (wish.beams) {
    const auto beams = static_cast<std::uint32_t>(ping_settings(all, device).beam_count);
    if (*wish.beams != beams)
      return refused(device.model->name + " forms " + std::to_string(beams) + " beams with this head, not " +
                     std::to_string(*wish.beams));
  }
  return protocol::ChangeSettings{ping_settings(all, device), bytes_of_settings(all), describe(all, device)};
}

}  // namespace sonar::blueview
