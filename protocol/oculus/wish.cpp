#include "protocol/oculus/wish.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include "protocol/oculus/fire.hpp"
#include "protocol/oculus/settings.hpp"

namespace sonar::oculus {
namespace {

constexpr std::array<PingRate, 5> rates{PingRate::hz2, PingRate::hz5, PingRate::hz10, PingRate::hz15, PingRate::hz40};

tl::unexpected<Error> refused(std::string text) { return failure(ErrorKind::usage, std::move(text)); }

PingRate nearest_rate(double rate_hz) {
  PingRate nearest = rates.front();
  for (const PingRate rate : rates)
    if (std::abs(table_rate_hz(rate) - rate_hz) < std::abs(table_rate_hz(nearest) - rate_hz)) nearest = rate;
  return nearest;
}

void set(FireSettings& fire, std::uint8_t bit, bool on) {
  fire.flags = static_cast<std::uint8_t>(on ? fire.flags | bit : fire.flags & ~bit);
}

}  // namespace

Result<protocol::ChangeSettings> wished(const protocol::Wish& wish, const protocol::DeviceState& device) {
  FireRequest fire = parse_fire(device.request).value_or(stored_fire());
  FireSettings& asked = fire.settings;
  const SonarModel& model = *device.model;
  char text[160];
  if (wish.mode) {
    if (*wish.mode >= model.modes.size())
      return refused(model.name + " has " + std::to_string(model.modes.size()) + " mode(s), counted from 0; there is no mode " +
                     std::to_string(*wish.mode));
    asked.mode = static_cast<std::uint8_t>(*wish.mode + 1);
  }
  if (wish.range_m) {
    const FrequencyMode& mode = model.modes[static_cast<std::size_t>(mode_index(model, asked.mode))];
    if (*wish.range_m < static_cast<double>(mode.min_range_m) || *wish.range_m > static_cast<double>(mode.max_range_m)) {
      std::snprintf(text, sizeof text, "%s sees from %g to %g m in mode %s, not %g m", model.name.c_str(),
                    static_cast<double>(mode.min_range_m), static_cast<double>(mode.max_range_m), mode.name.c_str(),
                    *wish.range_m);
      return refused(text);
    }
    set(asked, flag::range_in_metres, true);
    asked.range = *wish.range_m;
  }
  if (wish.rate_hz) {
    if (*wish.rate_hz < 0) return refused("a ping rate must be 0 (standby) or above");
    asked.ping_rate = *wish.rate_hz == 0 ? PingRate::standby : nearest_rate(*wish.rate_hz);
  }
  if (wish.gain_percent) {
    if (*wish.gain_percent < 0 || *wish.gain_percent > 100) return refused("gain_percent must be from 0 to 100");
    asked.gain_percent = *wish.gain_percent;
  }
  if (wish.beams) {
    if (*wish.beams != 256 && *wish.beams != 512)
      return refused(model.name + " forms 256 or 512 beams, not " + std::to_string(*wish.beams));
    set(asked, flag::beams_512, *wish.beams == 512);
  }
  // As a driver's would be: written, sent and read.
  const wire::Bytes message = make_fire(fire);
  const FireRequest received = parse_fire(message).value_or(fire);
  return protocol::ChangeSettings{settle(received, device).settings, message, describe(received)};
}

}  // namespace sonar::oculus
