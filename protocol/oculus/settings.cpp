#include "protocol/oculus/settings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "core/sonar/water.hpp"
#include "protocol/limits.hpp"
#include "protocol/oculus/models.hpp"

namespace sonar::oculus {
namespace {

constexpr double rest_per_ping_s = 0.002;  // assumed: time from the last echo to the next transmission
constexpr double surface_pressure_bar = 1.013;

constexpr int most_samples_per_row = 32;  // our choice: bounds the computing time of a row at long ranges

/// Clamps a value. If this changes the value, adds a message such as "range 20 m is outside 0.1..10 m, 10 m is used".
double clamped(double value, double low, double high, const char* what, const char* unit, std::vector<std::string>& messages) {
  const double used = std::clamp(value, low, high);
  if (used != value) {
    char text[160];
    std::snprintf(text, sizeof text, "%s %g %s is outside %g..%g %s, %g %s is used", what, value, unit, low, high, unit, used,
                  unit);
    messages.emplace_back(text);
  }
  return used;
}

/// Returns the range of row 0 in row spacings. unknown: the value of the device; each of these values is assumed by a driver
/// (option `row_origin`).
double row_centre(const protocol::OptionValues& options) {
  const std::string_view origin = text_option(options, option_name::row_origin);
  return origin == "near_edge" ? 0 : origin == "far_edge" ? 1 : 0.5;
}

/// Sets the pulse width and the number of samples whose mean power is a row (option `pulse`). The mode must be set already.
void set_pulse(PingSettings& settings, double spacing_m, const protocol::DeviceState& device) {
  const bool native = text_option(device.options, option_name::pulse) == "native";
  settings.pulse_width_m = static_cast<float>(native ? native_pulse_m : pulse_rows(*device.model, settings.mode) * spacing_m);
  if (!native) return;
  // The sampling rate is 2 b for the bandwidth b = 0.5887 c / pulse. At long ranges the pulse is longer, so that the number of
  // samples is limited.
  constexpr double samples_per_pulse = 4 * 0.5887;
  const double pulse_m = std::max(native_pulse_m, spacing_m * samples_per_pulse / most_samples_per_row);
  settings.pulse_width_m = static_cast<float>(pulse_m);
  settings.samples_per_row =
      std::clamp(static_cast<int>(std::ceil(spacing_m * samples_per_pulse / pulse_m - 1e-9)), 1, most_samples_per_row);
}

/// Returns the highest rate. Rates of a fire message are maxima, because a ping begins after the echoes of the previous ping have
/// returned.
double highest_rate_hz(const FireSettings& fire, const PingSettings& settings, const protocol::DeviceState& device) {
  double rate = std::min(table_rate_hz(fire.ping_rate), static_cast<double>(device.model->max_rate_hz));
  const double echo_time_s = 2.0 * settings.range_m / static_cast<double>(settings.device_sound_speed_mps);
  rate = std::min(rate, 1.0 / (echo_time_s + rest_per_ping_s));
  const bool limited = fire.network_speed != 0 && fire.network_speed != 255;
  if (limited && text_option(device.options, option_name::honour_network_speed) == "true")
    rate = std::min(rate, fire.network_speed * 1e6 / (8.0 * static_cast<double>(ping_size(settings))));
  return rate;
}

using protocol::refused;

constexpr std::array<PingRate, 5> rates{PingRate::hz2, PingRate::hz5, PingRate::hz10, PingRate::hz15, PingRate::hz40};

void set(FireSettings& fire, std::uint8_t bit, bool on) {
  fire.flags = static_cast<std::uint8_t>(on ? fire.flags | bit : fire.flags & ~bit);
}

}  // namespace

/// Computes a grid that fits the captured pings exactly; liboculus's authors measured the doubling on an M1200d
/// (docs/protocols/oculus.md, 5.4).
RowGrid row_grid(double range_m, double sound_speed_mps, double rate_hz) {
  RowGrid law{sound_speed_mps / (2 * rate_hz), 1};
  while (range_m / law.spacing_m > row_limit) law.spacing_m *= 2;
  law.count = std::max(1, static_cast<int>(std::floor(range_m / law.spacing_m)));
  return law;
}

double table_rate_hz(PingRate rate) {
  switch (rate) {
    case PingRate::hz15:
      return 15;
    case PingRate::hz40:
      return 40;
    case PingRate::hz5:
      return 5;
    case PingRate::hz2:
      return 2;
    case PingRate::standby:
      return 0;
    default:
      return 10;
  }
}

float gamma_from_byte(std::uint8_t value) { return value == 0 ? 1.0f : static_cast<float>(value) / 255.0f; }

SampleFormat sample_format(const FireRequest& fire) {
  SampleFormat format;
  format.gamma = gamma_from_byte(fire.settings.gamma);
  format.row_gains = (fire.settings.flags & flag::row_gains) != 0;
  if (fire.version >= 2 && (fire.extension.flags & flag::extended_32_bit) != 0) {
    format.bits = 32;
    format.max_code = std::numeric_limits<std::uint32_t>::max();
  } else if ((fire.settings.flags & flag::samples_16_bit) != 0) {
    format.bits = 16;
    format.max_code = 65535;
  } else {
    format.bits = 8;
    format.max_code = 254;  // capture: 255 never occurs, 254 is saturation
  }
  return format;
}

bool asks_for_gain_assist(const FireSettings& fire, std::string_view option) {
  const bool bit = (fire.flags & flag::gain_assist) != 0;
  return (option == "flag_set" && bit) || (option == "flag_clear" && !bit);
}

/// Returns the gain that pings state. In the high mode it is 40 + 0.6 g for a requested gain g (ENS inverts this); with gain
/// assist it is g, as in the captured pings (docs/protocols/oculus.md, 5.5).
double echoed_gain_percent(const FireSettings& fire, std::string_view gain_echo) {
  const bool high_frequency = fire.mode == 2;
  const bool mapped = gain_echo == "mapped" || (gain_echo != "verbatim" && (fire.flags & flag::gain_assist) == 0);
  return high_frequency && mapped ? 40 + 0.6 * fire.gain_percent : fire.gain_percent;
}

/// Returns the gain used plus 20 log r, close to the row gains of FIL's M750d (docs/decisions/0025-oculus-evidence.md).
std::vector<std::uint32_t> digital_row_gains(const PingSettings& settings) {
  std::vector<std::uint32_t> gains;
  gains.reserve(static_cast<std::size_t>(settings.range_bin_count));
  for (int row = 0; row < settings.range_bin_count; ++row) {
    const double spreading_db = settings.tvg ? 20 * std::log10(std::max(settings.range_of_row(row), row_gain_from_m)) : 0;
    const double gain = std::pow(10, (static_cast<double>(settings.gain_db) + spreading_db) / 10);
    gains.push_back(static_cast<std::uint32_t>(std::clamp(std::round(gain), 1.0, 4294967295.0)));
  }
  return gains;
}

bool has_non_finite(const FireSettings& fire) {
  return !std::isfinite(fire.range) || !std::isfinite(fire.gain_percent) || !std::isfinite(fire.sound_speed_mps) ||
         !std::isfinite(fire.salinity_ppt);
}

// Messages count modes from 1: 1 is the low frequency, 2 the high. Other values count as 1 (our choice).
int mode_index(const SonarModel& model, std::uint8_t wire_mode) { return wire_mode == 2 && model.modes.size() > 1 ? 1 : 0; }

double device_sound_speed_mps(const protocol::DeviceState& device, double salinity_ppt) {
  const double gauge_bar = absolute_pressure_bar(device.water, device.depth_m) - surface_pressure_bar;
  return sound_speed_unesco_mps(std::clamp(device.water.temperature_c, 0.0, 40.0), std::clamp(salinity_ppt, 0.0, 40.0),
                                std::clamp(gauge_bar, 0.0, 1000.0));
}

// Refuses no request: values out of range are clamped for use, and echoed as sent (docs/protocols/oculus.md, 3).
ResolvedSettings resolve(const FireRequest& fire, const protocol::DeviceState& device) {
  ResolvedSettings out;
  PingSettings& settings = out.settings;
  const FireSettings& asked = fire.settings;
  settings.mode = mode_index(*device.model, asked.mode);
  if (asked.mode != settings.mode + 1)
    out.clamped.push_back("this model has no mode " + std::to_string(asked.mode) + ", mode 1 is used");
  if (static_cast<std::uint8_t>(asked.ping_rate) > static_cast<std::uint8_t>(PingRate::standby))
    out.clamped.push_back("ping rate code " + std::to_string(static_cast<int>(asked.ping_rate)) + " is unknown, 10 Hz is used");
  const FrequencyMode& mode = device.model->modes[static_cast<std::size_t>(settings.mode)];

  const double salinity = clamped(asked.salinity_ppt, 0, 40, "salinity", "ppt", out.clamped);
  const double speed = asked.sound_speed_mps == 0 ? device_sound_speed_mps(device, salinity)
                                                  : clamped(asked.sound_speed_mps, 1300, 1700, "sound speed", "m/s", out.clamped);
  settings.device_sound_speed_mps = static_cast<float>(speed);
  // The device compensates for the absorption at the salinity that the client states, which may differ from the water's.
  Water believed = device.water;
  believed.salinity_psu = salinity;
  settings.device_absorption_db_per_m = static_cast<float>(absorption_db_per_m(believed, device.depth_m, mode.centre_hz));

  const bool metres = (asked.flags & flag::range_in_metres) != 0;
  const double range = metres ? asked.range : asked.range / 100 * static_cast<double>(mode.max_range_m);
  const double used_range = clamped(range, mode.min_range_m, mode.max_range_m, "range", "m", out.clamped);
  settings.range_m = used_range;
  const RowGrid rows = row_grid(used_range, speed, number_option(device.options, option_name::row_rate_hz));
  settings.range_bin_count = rows.count;
  settings.range_bin_m = rows.spacing_m;
  settings.row_centre = row_centre(device.options);
  set_pulse(settings, rows.spacing_m, device);

  settings.beam_count = (asked.flags & flag::beams_512) != 0 ? 512 : 256;
  settings.format = sample_format(fire);
  settings.tvg = settings.format.bits != 32;
  FireSettings used = asked;
  used.gain_percent = clamped(asked.gain_percent, 0, 100, "gain", "%", out.clamped);
  const bool scientific = settings.format.bits == 32;
  // Samples of 32 bits have the requested gain; only with the other formats may it be mapped to 40 + 0.6 g.
  const double percent =
      scientific ? used.gain_percent : echoed_gain_percent(used, text_option(device.options, option_name::gain_echo));
  settings.gain_db = static_cast<float>(db_per_percent * percent);
  settings.gain_assist = !scientific && asks_for_gain_assist(asked, text_option(device.options, option_name::gain_assist));
  settings.triggered = (asked.flags & flag::network_trigger) != 0;
  settings.rate_hz = static_cast<float>(highest_rate_hz(asked, settings, device));
  return out;
}

std::size_t ping_size(const PingSettings& settings) {
  const std::size_t row = static_cast<std::size_t>(settings.beam_count) * static_cast<std::size_t>(settings.format.bits / 8) +
                          (settings.format.row_gains ? 4 : 0);
  return image_offset + static_cast<std::size_t>(settings.range_bin_count) * row;
}

// The text states the requested values, so that users recognise what their driver sends.
std::string describe(const FireRequest& fire) {
  const FireSettings& s = fire.settings;
  const bool metres = (s.flags & flag::range_in_metres) != 0;
  const double rate_hz = table_rate_hz(s.ping_rate);
  char text[160];
  std::snprintf(text, sizeof text, "mode %d, range %g %s, gain %g %%, gamma %d, ", s.mode, s.range, metres ? "m" : "%",
                s.gain_percent, s.gamma);
  std::string sentence = text;
  if (rate_hz > 0) {
    std::snprintf(text, sizeof text, "rate %g Hz", rate_hz);
    sentence += text;
  } else {
    sentence += "standby";
  }
  if (s.sound_speed_mps == 0) {
    sentence += ", sound speed of the device";
  } else {
    std::snprintf(text, sizeof text, ", sound speed %g m/s", s.sound_speed_mps);
    sentence += text;
  }
  sentence += (s.flags & flag::beams_512) != 0 ? ", 512 beams" : ", 256 beams";
  sentence += ", " + std::to_string(sample_format(fire).bits) + " bits";
  sentence += ", flags " + std::to_string(s.flags) + ", version " + std::to_string(fire.version);
  if ((s.flags & flag::network_trigger) != 0) sentence += ", network trigger";
  return sentence;
}

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
  if (const std::string why = protocol::rate_complaint(wanted, model.name, model.max_rate_hz); !why.empty()) return refused(why);
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
