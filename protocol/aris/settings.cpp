#include "protocol/aris/settings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/text/format.hpp"
#include "protocol/limits.hpp"

namespace sonar::aris {
namespace {

constexpr std::uint32_t rest_us = 360;                  // time from the last sample to the end of a cycle (SDK document)
constexpr double lenient_share = 0.05;                  // assumed: the vendor's C++ sample sends cycles that are too short
constexpr auto focus_travel = std::chrono::seconds(1);  // from 0 to 1000; the device's log has about a second

struct Limits {
  const char* name;
  double low, high;
};

/// Returns the reason if a value is outside the range that the vendor documents, else an empty text.
std::string out_of_range(const Acoustics& a, const Product& product) {
  if (find_ping_mode(product, a.ping_mode) == nullptr) return "has no ping mode " + std::to_string(a.ping_mode);
  if (a.frequency != Frequency::low && a.frequency != Frequency::high) return "frequency must be 0 or 1";
  const std::pair<double, Limits> values[] = {
      {static_cast<double>(a.cookie), {"cookie", 1, 4294967295.0}},
      {static_cast<double>(a.frame_rate_hz), {"frame rate", 1, highest_rate_hz}},
      {static_cast<double>(a.samples_per_beam), {"samples per beam", least_samples, most_samples}},
      {static_cast<double>(a.start_delay_us), {"sample start delay", 930, 60000}},
      {static_cast<double>(a.cycle_us), {"cycle period", 1802, 150000}},
      {static_cast<double>(a.sample_period_us), {"sample period", 4, 100}},
      {static_cast<double>(a.pulse_us), {"pulse width", 5, 80}},
      {static_cast<double>(a.gain_db), {"receiver gain", 0, highest_gain_db}},
  };
  for (const auto& [value, limits] : values)
    if (!(value >= limits.low && value <= limits.high)) {
      char text[96];
      std::snprintf(text, sizeof text, "%s %g is outside %g..%g", limits.name, value, limits.low, limits.high);
      return text;
    }
  return {};
}

using protocol::refused;

constexpr std::uint32_t longest_period_us = 100, longest_pulse_us = 80;

/// Sets the requested mode, or the ping mode with the requested number of beams.
Result<void> set_mode(Settings& s, const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  const Product& product = product_of(*device.model);
  if (wanted.mode) {
    if (*wanted.mode >= device.model->modes.size())
      return refused(device.model->name + " has " + std::to_string(device.model->modes.size()) +
                     " mode(s), counted from 0; no mode " + std::to_string(*wanted.mode));
    const ModeChoice choice = choice_of(product, static_cast<int>(*wanted.mode));
    s.acoustics.ping_mode = choice.ping_mode;
    s.acoustics.frequency = choice.frequency;
    s.telephoto = choice.telephoto;
  }
  const int beams = find_ping_mode(product, s.acoustics.ping_mode)->beams();
  if (!wanted.beams || beams == static_cast<int>(*wanted.beams)) return {};
  const std::string asked = ", not " + std::to_string(*wanted.beams);
  if (wanted.mode) return refused(device.model->name + " forms " + std::to_string(beams) + " beams in this mode" + asked);
  for (const PingMode& mode : product.ping_modes) {
    if (mode.beams() != static_cast<int>(*wanted.beams)) continue;
    s.acoustics.ping_mode = mode.number;
    return {};
  }
  const std::string counts =
      text::joined(product.ping_modes, " or ", [](const PingMode& m) { return std::to_string(m.beams()); });
  return refused(device.model->name + " forms " + counts + " beams" + asked);
}

/// Changes the end of the window, not its start, and keeps the sample period if the resulting number of samples is valid. Makes
/// the pulse at least as long as the sample period.
Result<void> set_range(Settings& s, double range_m, const protocol::DeviceState& device) {
  const PingSettings now = ping_settings(s, device);
  const double speed = static_cast<double>(now.device_sound_speed_mps), end_m = product_of(*device.model).window_end_m;
  const double low_m = now.range_start_m + 1e-6 * shortest_period_us * least_samples * speed / 2;
  if (const std::string why = protocol::range_complaint(range_m, device.model->name, low_m, end_m); !why.empty())
    return refused(why);
  Acoustics& a = s.acoustics;
  const double window_us = 2e6 * (range_m - now.range_start_m) / speed;
  const double finest_us = std::ceil(window_us / most_samples), coarsest_us = std::floor(window_us / least_samples);
  const double period_us = std::clamp(static_cast<double>(a.sample_period_us), finest_us, std::max(finest_us, coarsest_us));
  a.sample_period_us = static_cast<std::uint32_t>(
      std::clamp(period_us, static_cast<double>(shortest_period_us), static_cast<double>(longest_period_us)));
  a.samples_per_beam =
      std::clamp(static_cast<std::uint32_t>(std::lround(window_us / a.sample_period_us)), least_samples, most_samples);
  a.pulse_us = std::max(a.pulse_us, std::min(a.sample_period_us, longest_pulse_us));  // judge() limits the pulse
  return {};
}

}  // namespace

// The salinity is the allowed value nearest to that of the water; the focus is at an eighth of the longest range.
Settings initial_settings(const protocol::DeviceState& device) {
  Settings s;
  const Product& product = product_of(*device.model);
  s.acoustics = product.initial;
  s.salinity = device.water.salinity_psu < 7 ? 0 : device.water.salinity_psu < 25 ? 15 : 35;
  s.focus_from = s.focus_to = focus_position(product.window_end_m / 8, product);
  s.first_ping = device.last_ping;
  return s;
}

Settings settings_from(const VendorSettings* held, const protocol::DeviceState& device) {
  const auto* of = dynamic_cast<const HeldSettings*>(held);
  return of != nullptr ? of->settings : initial_settings(device);
}

// The vendor's formula, with which clients compute the ranges of samples. Other formulas differ by some tenths of a metre per
// second, which would shift these ranges.
double sound_speed_mps(double t, double s, double z) {
  return 1402.5 + 5 * t - 5.44e-2 * t * t + 2.1e-4 * t * t * t + 1.33 * s - 1.23e-2 * s * t + 8.7e-5 * s * t * t + 1.56e-2 * z +
         2.55e-7 * z * z - 7.3e-12 * z * z * z;
}

std::uint32_t shortest_cycle_us(const Acoustics& a) {
  return a.start_delay_us + a.sample_period_us * a.samples_per_beam + rest_us;
}

// The formula of the vendor's SDK: the duration of a frame is that of its cycles plus a margin, which depends on the product,
// plus the time of its packets if they are sent with a delay.
double highest_frame_rate_hz(const Product& product, const Acoustics& a, std::optional<std::uint32_t> packet_delay_us) {
  constexpr double overhead_us = 420, per_packet_us = 16.6;
  const PingMode& mode = *find_ping_mode(product, a.ping_mode);
  const double margin = a.sample_period_us <= 4 ? product.small_period_margin : product.period_margin;
  const double shortest_us = a.start_delay_us + a.sample_period_us * static_cast<double>(a.samples_per_beam) + overhead_us;
  const double beyond_us = a.cycle_us > shortest_cycle_us(a) ? a.cycle_us - shortest_cycle_us(a) : 0;
  double frame_us = mode.pings * (shortest_us * (1 + margin) + beyond_us);
  if (packet_delay_us) {
    const auto packets = (static_cast<std::uint32_t>(mode.beams()) * a.samples_per_beam + 1024) / 1392;
    frame_us += packets * (per_packet_us + *packet_delay_us);
  }
  return std::clamp(1e6 / frame_us, 1.0, highest_rate_hz);
}

Verdict judge(const Acoustics& asked, const Product& product, bool lenient_cycle, std::optional<std::uint32_t> packet_delay_us) {
  Verdict verdict{out_of_range(asked, product), asked, false};
  if (!verdict.refusal.empty()) return verdict;
  Acoustics& used = verdict.used;
  const std::uint32_t needed_us = shortest_cycle_us(asked);
  // The checks are in the order of docs/protocols/aris.md, "Acoustic settings": first settings that are refused, then settings
  // that are limited.
  const double accepted_us = needed_us * (lenient_cycle ? 1 - lenient_share : 1.0);
  char text[128] = "";
  if (asked.cycle_us < accepted_us)
    std::snprintf(text, sizeof text, "cycle period %u us is too short: %u us are needed", asked.cycle_us, needed_us);
  const int pings = find_ping_mode(product, asked.ping_mode)->pings;
  const double frame_us = std::ceil(1e6 / static_cast<double>(asked.frame_rate_hz));
  if (frame_us <= static_cast<double>(asked.cycle_us) * pings)
    std::snprintf(text, sizeof text, "%d cycles of %u us do not fit a frame of %g us", pings, asked.cycle_us, frame_us);
  verdict.refusal = text;
  if (!verdict.refusal.empty()) return verdict;
  // The cycle limits the frame rate, and the frame rate limits the pulse: the energy of the pulses per second is bounded.
  used.cycle_us = std::max(asked.cycle_us, needed_us);
  used.frame_rate_hz = std::min(asked.frame_rate_hz, static_cast<float>(highest_frame_rate_hz(product, used, packet_delay_us)));
  const double limit_us = product.pulse_limit_us[static_cast<std::size_t>(asked.frequency)];
  const double longest_us = std::min(limit_us, product.pulse_energy_us_hz / static_cast<double>(used.frame_rate_hz));
  used.pulse_us = std::min(asked.pulse_us, static_cast<std::uint32_t>(longest_us));
  verdict.constrained = used != asked;
  return verdict;
}

Verdict apply(Settings& settings, const Acoustics& asked, const protocol::DeviceState& device) {
  const auto delay = settings.delays_packets ? std::optional(settings.packet_delay_us) : std::nullopt;
  const bool lenient = text_option(device.options, option_name::cycle) == "lenient";
  const Verdict verdict = judge(asked, product_of(*device.model), lenient, delay);
  if (!verdict.refusal.empty()) {
    settings.invalid = asked.cookie;  // a refused request changes nothing else
    return verdict;
  }
  settings.acoustics = verdict.used;
  settings.valid = true;
  (verdict.constrained ? settings.constrained : settings.applied) = asked.cookie;
  return verdict;
}

std::uint32_t focus_position(double range_m, const Product& product) {
  return static_cast<std::uint32_t>(std::lround(1000 * std::clamp(range_m / product.window_end_m, 0.0, 1.0)));
}

FocusNow focus_at(const Settings& s, Time at) {
  const double distance = std::abs(static_cast<double>(s.focus_to) - s.focus_from) / 1000;
  const double travelled = std::max(seconds(at - s.focus_set_at) / seconds(focus_travel), 0.0);
  if (travelled >= distance) return {s.focus_to, false};
  const double step = std::copysign(1000 * travelled, static_cast<double>(s.focus_to) - s.focus_from);
  return {static_cast<std::uint32_t>(std::lround(s.focus_from + step)), true};
}

PingSettings ping_settings(const Settings& settings, const protocol::DeviceState& device) {
  const Acoustics& a = settings.acoustics;
  const Product& product = product_of(*device.model);
  const bool telephoto = settings.telephoto && product.has_telephoto;
  PingSettings s;
  s.mode = mode_index(product, {a.ping_mode, a.frequency, telephoto}).value_or(0);
  const FrequencyMode& mode = device.model->modes[static_cast<std::size_t>(s.mode)];
  const double speed = sound_speed_mps(device.water.temperature_c, settings.salinity, device.depth_m);
  const double m_per_us = speed * 1e-6 / 2;
  s.beam_count = static_cast<int>(mode.beam_azimuths_rad.size());
  s.range_bin_count = static_cast<int>(a.samples_per_beam);
  s.range_bin_m = a.sample_period_us * m_per_us;
  s.range_start_m = a.start_delay_us * m_per_us;
  s.range_m = s.range_start_m + s.range_bin_count * s.range_bin_m;
  s.row_centre = 0;  // the time of sample i is the start delay plus i sample periods
  // -3 dB of a tone in its matched filter (docs/acoustics.md, eq. 23).
  const double width_m = (2 - std::sqrt(2.0)) * a.pulse_us * m_per_us;
  s.pulse_width_m = static_cast<float>(width_m);
  s.samples_per_row =
      std::clamp(static_cast<int>(std::ceil(s.range_bin_m * samples_per_pulse / width_m - 1e-9)), 1, most_samples_per_row);
  s.rate_hz = settings.valid && settings.streaming ? a.frame_rate_hz : 0;
  s.ping_interval_s = a.cycle_us * 1e-6;
  s.gain_db = a.gain_db;
  s.transmit = a.transmit;
  s.device_sound_speed_mps = static_cast<float>(speed);
  s.device_absorption_db_per_m = 0;  // assumed, because the level of a real recording falls over the whole range
  s.format = {.bits = 8, .max_code = 255, .scale = SampleFormat::Scale::logarithmic, .floor_db = 0, .ceiling_db = 80};
  return s;
}

protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device) {
  const Acoustics& a = settings.acoustics;
  const PingSettings s = ping_settings(settings, device);
  char text[200];
  std::snprintf(text, sizeof text, "%s, %d beams, %g Hz, window %.2f to %.2f m, %u samples, pulse %u us, gain %g dB, salinity %u",
                device.model->modes[static_cast<std::size_t>(s.mode)].name.c_str(), s.beam_count, static_cast<double>(s.rate_hz),
                s.range_start_m, s.range_m, a.samples_per_beam, a.pulse_us, static_cast<double>(a.gain_db), settings.salinity);
  return {s, std::make_shared<HeldSettings>(settings), text};
}

std::span<const protocol::Option> options() {
  static const std::array<protocol::Option, 6> all{{
      {option_name::cycle,
       {"lenient", "documented"},
       "lenient",
       "a cycle period up to 5 % too short: raise it and report the settings as constrained, or refuse them"},
      {option_name::reordered, {"false", "true"}, "false", "true: frames carry the picture, not the channels of each ping"},
      {option_name::receivers,
       {"any", "controller"},
       "any",
       "addresses to which a controller may direct frames: any, or only its own and multicast groups"},
      {option_name::silence_s, {}, "10", "seconds without a command after which a controller is disconnected", 5, 600},
      {option_name::header_bytes, {}, "744", "bytes of a frame header; older firmware sends fewer", 128, 744, {}, true},
      {option_name::datagram_bytes,
       {},
       "1400",
       "longest datagram, in bytes; Ethernet fragments datagrams of more than 1472",
       1400,
       65000,
       {},
       true},
  }};
  return all;
}

// Converts a SettingsOverride to the SET_ACOUSTICS that a controller would send for it.
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  Settings s = settings_from(device.settings.get(), device);
  if (auto r = set_mode(s, wanted, device); !r) return tl::make_unexpected(r.error());
  if (wanted.range_m)
    if (auto r = set_range(s, *wanted.range_m, device); !r) return tl::make_unexpected(r.error());
  Acoustics& a = s.acoustics;
  if (wanted.rate_hz) {
    if (*wanted.rate_hz < 1 || *wanted.rate_hz > highest_rate_hz)
      return refused(text::format("the rate of an ARIS is 1 to %g Hz, not %g Hz; only a controller can stop it", highest_rate_hz,
                                  *wanted.rate_hz));
    a.frame_rate_hz = static_cast<float>(*wanted.rate_hz);
  }
  if (const std::string why = protocol::gain_complaint(wanted); !why.empty()) return refused(why);
  if (wanted.gain_percent) {
    a.gain_db = static_cast<float>(highest_gain_db * *wanted.gain_percent / 100);
  }
  if (wanted.sample_bits && *wanted.sample_bits != 8)
    return refused("an ARIS sends samples of 8 bits, not of " + std::to_string(*wanted.sample_bits));
  if (wanted.row_gains && *wanted.row_gains) return refused("an ARIS sends no row gains");
  if (wanted.range_m || wanted.mode || wanted.beams) a.cycle_us = shortest_cycle_us(a);
  const Product& product = product_of(*device.model);
  a.frame_rate_hz = std::min(a.frame_rate_hz, static_cast<float>(highest_frame_rate_hz(product, a, std::nullopt)));
  // judge() refuses a cookie of 0, which the settings have until a controller has sent a SET_ACOUSTICS.
  Acoustics numbered = a;
  numbered.cookie = std::max(a.cookie, 1u);
  const Verdict verdict = judge(numbered, product, true);
  if (!verdict.refusal.empty()) return refused(device.model->name + ": " + verdict.refusal);
  a.pulse_us = verdict.used.pulse_us;
  return change_to(s, device);
}

}  // namespace sonar::aris
