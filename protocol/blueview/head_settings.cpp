#include "protocol/blueview/head_settings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "protocol/blueview/models.hpp"
#include "protocol/limits.hpp"

namespace sonar::blueview {
namespace {

constexpr int most_bins = 2400;     // in a ping; longer ranges get longer bins (our choice)
constexpr float base_gain_db = 48;  // unknown: the real gain at an adjustment of 0 dB
constexpr float longest_interval_ms = 3600e3f;

const FrequencyMode& mode_of(const protocol::DeviceState& device, int head) {
  return device.model->modes[static_cast<std::size_t>(head)];
}
bool strict_range(const protocol::DeviceState& device) { return text_option(device.options, option_name::strict_range) == "on"; }

/// Returns the number in a value; nullopt for texts, pairs, NaN and infinity. Hosts may send integers and floats for any numeric
/// key, as the interface of the SDK does.
std::optional<double> number_in(const Value& value) {
  if (const auto* i = std::get_if<std::int32_t>(&value)) return *i;
  if (const auto* f = std::get_if<float>(&value)) return std::isfinite(*f) ? std::optional<double>(*f) : std::nullopt;
  return std::nullopt;
}

Applied refused(Code code, std::string text) { return {std::nullopt, {code, std::move(text)}}; }

/// Returns the length of the shortest window.
float shortest_of(const FrequencyMode& mode) { return std::max(0.1f, 0.01f * mode.max_range_m); }

/// Sets start and stop together, because the start must be less than the stop. Values out of range are clamped, or refused if
/// `strict`; the answer has the applied values.
Applied apply_range(HeadSettings& head, const FrequencyMode& mode, float start, float stop, bool strict, Key key) {
  if (!std::isfinite(start) || !std::isfinite(stop)) return refused(Code::bad_parameter, "a range must be a finite number");
  const bool fine = start >= mode.min_range_m && stop <= mode.max_range_m && start < stop;
  char text[128];
  std::snprintf(text, sizeof text, "range %g to %g m is not within %g to %g m", static_cast<double>(start),
                static_cast<double>(stop), static_cast<double>(mode.min_range_m), static_cast<double>(mode.max_range_m));
  if (!fine && strict) return refused(Code::bad_range, text);
  const float shortest = shortest_of(mode);
  // The stop is clamped first, then the start, so that the window is at least `shortest`.
  head.stop_m = std::clamp(stop, mode.min_range_m + shortest, mode.max_range_m);
  head.start_m = std::clamp(start, 0.0f, head.stop_m - shortest);
  if (key == Key::range) return {Value(FloatPair{head.start_m, head.stop_m}), {}};
  return {Value(key == Key::start_range ? head.start_m : head.stop_m), {}};
}

template <class T>
Applied keep(T& at, double value, double low, double high) {
  at = static_cast<T>(std::clamp(value, low, high));
  return {Value(at), {}};
}

/// Clamps a number to the limits of its key, and stores it. The keys from dynamic_power on have no other effect, because their
/// effect on a real head is unknown.
Applied apply_number(HeadSettings& head, SonarSettings& all, Key key, double value) {
  switch (key) {
    case Key::sound_speed:
      return keep(head.sound_speed_mps, value, 1000, 2000);
    case Key::gain:
      return keep(head.gain_db, value, -100, 100);
    case Key::tvg:
      return keep(head.tvg_db_per_m, value, -20, 20);
    case Key::fluid:
      return keep(head.fluid, value, 0, 2);
    case Key::transmit:
      return keep(head.transmit, value != 0 ? 1 : 0, 0, 1);
    case Key::ping_interval:
      return keep(head.ping_interval_ms, value, 0, static_cast<double>(longest_interval_ms));
    case Key::dynamic_power:
      return keep(head.dynamic_power, value != 0 ? 1 : 0, 0, 1);
    case Key::source_level:
      return keep(head.source_level_db, value, -300, 300);
    case Key::local_clock:
      return keep(all.local_clock, value != 0 ? 1 : 0, 0, 1);
    default:
      return refused(Code::bad_parameter, "unknown key " + std::to_string(static_cast<int>(key)));
  }
}

bool is_range(Key key) { return key == Key::start_range || key == Key::stop_range || key == Key::range; }

using protocol::refused;

constexpr double half_gain_db = 48;  // assumed: 0 to 100 % are -48 to 48 dB, a span like that of an Oculus

Result<void> set(SonarSettings& all, Key key, const Value& value, const protocol::DeviceState& device) {
  const Applied applied = apply(all, all.active_head, key, value, device);
  if (!applied.value) return refused(applied.refusal.text);
  return {};
}

Result<void> set_range(SonarSettings& all, double range_m, const protocol::DeviceState& device) {
  const FrequencyMode& mode = device.model->modes[static_cast<std::size_t>(all.active_head)];
  const double start_m = static_cast<double>(all.heads[static_cast<std::size_t>(all.active_head)].start_m);
  const double low_m = std::max(start_m, static_cast<double>(mode.min_range_m)) + static_cast<double>(shortest_of(mode));
  const std::string why = protocol::range_complaint(range_m, device.model->name + " with this head", low_m,
                                                    static_cast<double>(mode.max_range_m), "stop_range");
  if (!why.empty()) return refused(why);
  return set(all, Key::stop_range, static_cast<float>(range_m), device);
}

Result<void> set_rate(SonarSettings& all, double rate_hz, const protocol::DeviceState& device) {
  if (rate_hz < 0) return refused(text::format("the rate of a BlueView must be above 0 Hz, not %g Hz", rate_hz));
  if (rate_hz == 0)
    return refused("BlueView sonars have no standby: they ping when a host asks; to silence one, set transmit: false");
  protocol::SettingsOverride wanted;
  wanted.rate_hz = rate_hz;
  const std::string why = protocol::rate_complaint(wanted, device.model->name, device.model->max_rate_hz);
  if (!why.empty()) return refused(why);
  return set(all, Key::ping_interval, ping_interval_ms(rate_hz), device);
}

}  // namespace

SonarSettings initial_sonar_settings(const protocol::DeviceState& device) {
  SonarSettings all;
  all.name = device.name;
  for (const HeadPreset& preset : head_presets(device.model->profile)) {
    HeadSettings head;
    head.start_m = static_cast<float>(preset.start_m);
    head.stop_m = static_cast<float>(preset.stop_m);
    head.fluid = device.water.salinity_psu < 1 ? 1 : 0;
    all.heads.push_back(head);
  }
  return all;
}

bool SonarSettings::equals(const VendorSettings& other) const {
  const auto* of = dynamic_cast<const SonarSettings*>(&other);
  return of != nullptr && active_head == of->active_head && local_clock == of->local_clock && name == of->name &&
         heads == of->heads;
}

SonarSettings settings_from(const VendorSettings* settings, const protocol::DeviceState& device) {
  const auto* of = dynamic_cast<const SonarSettings*>(settings);
  return of != nullptr ? *of : initial_sonar_settings(device);
}

// All checks of a SET are here; a refused SET changes nothing.
Applied apply(SonarSettings& settings, int head_index, Key key, const Value& value, const protocol::DeviceState& device) {
  if (head_index < 0 || head_index >= static_cast<int>(settings.heads.size()))
    return refused(Code::no_head, "no head " + std::to_string(head_index));
  HeadSettings& head = settings.heads[static_cast<std::size_t>(head_index)];
  if (key == Key::name) {
    const auto* text = std::get_if<std::string>(&value);
    if (text == nullptr) return refused(Code::bad_parameter, "a name must be a text");
    // The end must not split a character of UTF-8, whose further bytes begin with the bits 10.
    std::size_t size = std::min<std::size_t>(text->size(), 64);
    while (size > 0 && size < text->size() && ((*text)[size] & 0xC0) == 0x80) --size;
    settings.name = text->substr(0, size);
    return {Value(settings.name), {}};
  }
  if (is_range(key)) {
    const auto* pair = std::get_if<FloatPair>(&value);
    const auto number = number_in(value);
    if (key == Key::range ? pair == nullptr : !number) return refused(Code::bad_parameter, "a range must be a finite number");
    const float given = number ? static_cast<float>(*number) : 0;
    const float start = pair ? pair->first : (key == Key::start_range ? given : head.start_m);
    const float stop = pair ? pair->second : (key == Key::stop_range ? given : head.stop_m);
    return apply_range(head, mode_of(device, head_index), start, stop, strict_range(device), key);
  }
  const auto number = number_in(value);
  if (!number) return refused(Code::bad_parameter, "key " + std::to_string(static_cast<int>(key)) + " must be a finite number");
  return apply_number(head, settings, key, *number);
}

std::optional<Value> read_back(const SonarSettings& settings, int head_index, Key key) {
  if (head_index < 0 || head_index >= static_cast<int>(settings.heads.size())) return std::nullopt;
  const HeadSettings& head = settings.heads[static_cast<std::size_t>(head_index)];
  switch (key) {
    case Key::start_range:
      return head.start_m;
    case Key::stop_range:
      return head.stop_m;
    case Key::range:
      return FloatPair{head.start_m, head.stop_m};
    case Key::sound_speed:
      return head.sound_speed_mps;
    case Key::gain:
      return head.gain_db;
    case Key::tvg:
      return head.tvg_db_per_m;
    case Key::fluid:
      return head.fluid;
    case Key::transmit:
      return head.transmit;
    case Key::ping_interval:
      return head.ping_interval_ms;
    case Key::dynamic_power:
      return head.dynamic_power;
    case Key::source_level:
      return head.source_level_db;
    case Key::name:
      return settings.name;
    case Key::local_clock:
      return settings.local_clock;
  }
  return std::nullopt;
}

HeadGrid grid_of(const HeadSettings& head, double finest_bin_m) {
  HeadGrid grid;
  const double start = static_cast<double>(head.start_m), stop = static_cast<double>(head.stop_m);
  grid.bin_m = std::max(finest_bin_m, (stop - start) / most_bins);
  grid.bins = std::max(1, static_cast<int>(std::lround((stop - start) / grid.bin_m)));
  // The pipeline's rows begin at the sonar. The rows before the start are dropped, and the grid is shifted by a fraction of a
  // row, so that the centre of the first bin is half a bin after the start.
  const double rows_before = start / grid.bin_m;
  grid.skipped = static_cast<int>(std::floor(rows_before + 0.5));
  grid.row_centre = std::clamp(0.5 + rows_before - grid.skipped, 0.0, 1.0);
  return grid;
}

PingSettings ping_settings(const SonarSettings& all, const protocol::DeviceState& device) {
  const int index = all.active_head;
  const HeadSettings& head = all.heads[static_cast<std::size_t>(index)];
  const HeadPreset& preset = head_presets(device.model->profile)[static_cast<std::size_t>(index)];
  const FrequencyMode& mode = mode_of(device, index);
  const HeadGrid grid = grid_of(head, preset.bin_m);
  PingSettings s;
  s.mode = index;
  s.beam_count = preset.beams;
  s.range_bin_count = grid.skipped + grid.bins;
  s.range_bin_m = grid.bin_m;
  s.row_centre = grid.row_centre;
  s.range_m = s.range_bin_count * grid.bin_m;
  s.pulse_width_m = static_cast<float>(grid.bin_m);  // data sheets: the pulse is as long as the bin
  s.rate_hz = head.ping_interval_ms > 0 ? std::min(1000.0f / static_cast<float>(head.ping_interval_ms), device.model->max_rate_hz)
                                        : device.model->max_rate_hz;
  // A head transmits on request only; a subscription requests each of its pings.
  s.triggered = true;
  s.transmit = head.transmit != 0;
  s.gain_db = base_gain_db + head.gain_db;
  s.device_sound_speed_mps = static_cast<float>(head.sound_speed_mps);
  // The device compensates the absorption of the fluid that the host states; for `other`, the absorption of the actual water.
  Water believed = device.water;
  if (head.fluid == 0) believed.salinity_psu = std::max(believed.salinity_psu, 30.0);
  if (head.fluid == 1) believed.salinity_psu = 0;
  // The absorption applies to the path out and to the path back, but tvg_db_per_m applies once to each metre of range. So half of
  // tvg_db_per_m is added to the absorption.
  s.device_absorption_db_per_m =
      static_cast<float>(absorption_db_per_m(believed, device.depth_m, static_cast<double>(mode.centre_hz)) +
                         0.5 * static_cast<double>(head.tvg_db_per_m));
  s.format.bits = 16;  // unknown: the device's sample width; BlueView images have 16-bit samples
  s.format.max_code = 65535;
  return s;
}

std::string describe(const SonarSettings& all, const protocol::DeviceState& device) {
  const HeadSettings& head = all.heads[static_cast<std::size_t>(all.active_head)];
  char text[160];
  std::snprintf(text, sizeof text, "head %d (%s), range %g to %g m, gain %g dB, tvg %g dB/m, sound speed %d m/s%s",
                all.active_head, mode_of(device, all.active_head).name.c_str(), static_cast<double>(head.start_m),
                static_cast<double>(head.stop_m), static_cast<double>(head.gain_db), static_cast<double>(head.tvg_db_per_m),
                head.sound_speed_mps, head.transmit != 0 ? "" : ", transmitter off");
  return text;
}

std::span<const protocol::Option> options() {
  static const std::array<protocol::Option, 3> all{{
      {option_name::heads_base,
       {"0", "1", "strict"},
       "0",
       "id of the first head; a sonar of one head accepts both 0 and 1, unless this is strict (0 only)"},
      {option_name::strict_range,
       {"off", "on"},
       "off",
       "a range outside that of the product is refused with error 4009 (on) or clamped (off)"},
      {option_name::compression, {"none", "deflate"}, "none", "compression of the samples; deflate is for slow links"},
  }};
  return all;
}

std::int32_t ping_interval_ms(double rate_hz) {
  return static_cast<std::int32_t>(std::clamp(std::round(1000 / rate_hz), 1.0, 3600e3));
}

float gain_db_from(double percent) { return static_cast<float>(half_gain_db * (percent / 50 - 1)); }

double gain_percent_from(double gain_db) { return 50 * (gain_db / half_gain_db + 1); }

// By default (option strict_range) SET clamps a range that is not possible. An override always refuses such a range, and the
// error states the limits of the product (Vendor::apply_override).
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
