#include "protocol/oculus/settings_override.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include "protocol/limits.hpp"
#include "protocol/oculus/fire.hpp"
#include "protocol/oculus/settings.hpp"

namespace sonar::oculus {
namespace {

constexpr std::array<PingRate, 5> rates{PingRate::hz2, PingRate::hz5, PingRate::hz10, PingRate::hz15, PingRate::hz40};

tl::unexpected<Error> refused(std::string text) { return failure(ErrorKind::usage, std::move(text)); }

void set(FireSettings& fire, std::uint8_t bit, bool on) {
  fire.flags = static_cast<std::uint8_t>(on ? fire.flags | bit : fire.flags & ~bit);
}

}  // namespace

PingRate nearest_rate(double rate_hz) {
  PingRate nearest = rates.front();
  for (const PingRate rate : rates)
    if (std::abs(table_rate_hz(rate) - rate_hz) < std::abs(table_rate_hz(nearest) - rate_hz)) nearest = rate;
  return nearest;
}

Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  FireRequest fire = fire_of(device.settings.get());
  FireSettings& asked = fire.settings;
  const SonarModel& model = *device.model;
  if (wanted.mode) {
    if (*wanted.mode >= model.modes.size())
      return refused(model.name + " has " + std::to_string(model.modes.size()) + " mode(s), counted from 0; no mode " +
                     std::to_string(*wanted.mode));
    asked.mode = static_cast<std::uint8_t>(*wanted.mode + 1);
  }
  if (wanted.range_m) {
    const FrequencyMode& mode = model.modes[static_cast<std::size_t>(mode_index(model, asked.mode))];
    const std::string why =
        protocol::range_complaint(*wanted.range_m, model.name + " in mode " + mode.name, static_cast<double>(mode.min_range_m),
                                  static_cast<double>(mode.max_range_m));
    if (!why.empty()) return refused(why);
    set(asked, flag::range_in_metres, true);
    asked.range = *wanted.range_m;
  }
  if (const std::string why = protocol::rate_complaint(wanted); !why.empty()) return refused(why);
  if (wanted.rate_hz) {
    asked.ping_rate = *wanted.rate_hz == 0 ? PingRate::standby : nearest_rate(*wanted.rate_hz);
  }
  if (const std::string why = protocol::gain_complaint(wanted); !why.empty()) return refused(why);
  if (wanted.gain_percent) {
    asked.gain_percent = *wanted.gain_percent;
  }
  if (wanted.beams) {
    if (*wanted.beams != 256 && *wanted.beams != 512)
      return refused(model.name + " forms 256 or 512 beams, not " + std::to_string(*wanted.beams));
    set(asked, flag::beams_512, *wanted.beams == 512);
  }
  if (wanted.sample_bits) {
    const std::uint32_t bits = *wanted.sample_bits;
    const bool extended = fire.version >= 2;
    if (bits != 8 && bits != 16 && !(bits == 32 && extended))
      return refused(model.name + " sends samples of 8 or 16 bits, and of 32 to a client with messages of version 2, not of " +
                     std::to_string(bits));
    set(asked, flag::samples_16_bit, bits == 16);
    if (extended)
      fire.extension.flags =
          bits == 32 ? fire.extension.flags | flag::extended_32_bit : fire.extension.flags & ~flag::extended_32_bit;
  }
  if (wanted.row_gains) set(asked, flag::row_gains, *wanted.row_gains);
  // The request is encoded and parsed again, so that the result is the same as for a driver that sends it: version 0 and 1 have
  // no extension.
  const FireRequest received = parse_fire(make_fire(fire)).value_or(fire);
  return protocol::ChangeSettings{resolve(received, device).settings, std::make_shared<HeldFire>(received), describe(received)};
}

}  // namespace sonar::oculus
