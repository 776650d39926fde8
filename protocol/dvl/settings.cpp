#include "protocol/dvl/settings.hpp"

#include "protocol/limits.hpp"

namespace sonar::dvl {

HeldSettings::HeldSettings(const Settings& s, const Product& product) : settings(s) {
  beam_height_rad = rad_from_deg(product.beam_deg) / std::sqrt(2.0);
  range_unit_m = product.range_unit_m;
  range_sample_m = 0.0096;  // DOC: the distances of its example are multiples of this
}

bool HeldSettings::equals(const VendorSettings& other) const {
  const auto* of = dynamic_cast<const HeldSettings*>(&other);
  return of != nullptr && of->settings.configured() == settings.configured();
}

// The device begins its search with the highest allowed mode.
bool allow_modes(std::string_view text, Settings& settings) {
  const auto mode = [](char c) { return c >= '0' && c < '0' + range_mode_count ? std::optional(c - '0') : std::nullopt; };
  std::optional<int> lowest, highest;
  if (text == "auto") {
    lowest = 0;
    highest = range_mode_count - 1;
  } else if (text.size() == 2 && text[0] == '=') {
    lowest = highest = mode(text[1]);
  } else if (text.size() == 4 && text.substr(1, 2) == "<=") {
    lowest = mode(text[0]);
    highest = mode(text[3]);
  }
  if (!lowest || !highest || *lowest > *highest) return false;
  settings.range_mode = text;
  settings.lowest_mode = *lowest;
  settings.highest_mode = settings.mode = *highest;
  return true;
}

std::string range_mode_for(double range_m, const Product& product) {
  int mode = 0;
  while (mode + 1 < range_mode_count && range_mode(mode, product).highest_m < range_m) ++mode;
  return mode + 1 == range_mode_count ? "auto" : "0<=" + std::to_string(mode);
}

PingSettings ping_settings(const Settings& settings, const Product& product) {
  const RangeMode mode = range_mode(settings.mode, product);
  PingSettings s;
  s.beam_count = s.range_bin_count = grid_size;
  s.range_start_m = mode.lowest_m;  // not divided by the cosine: over rising ground a beam may be as short as the altitude
  s.range_m = mode.highest_m / altitude_per_distance;
  s.range_bin_m = (s.range_m - s.range_start_m) / grid_size;
  s.pulse_width_m = static_cast<float>(mode.pulse_m);
  s.rate_hz = settings.acoustics || settings.is_triggered ? mode.rate_hz : 0;
  s.triggered = !settings.acoustics;
  s.device_sound_speed_mps = static_cast<float>(settings.speed_of_sound_mps);
  s.format = {.bits = 32, .max_code = range_image_max_code(RangePixel::most_strength)};
  return s;
}

protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device) {
  const Product& product = product_of(*device.model);
  return {ping_settings(settings, product), std::make_shared<HeldSettings>(settings, product),
          text::format("acoustics %s, range mode %s, speed of sound %g m/s, mounting rotation %g degrees",
                       settings.acoustics ? "on" : "off", settings.range_mode.c_str(), settings.speed_of_sound_mps,
                       settings.mounting_rotation_deg)};
}

// Refuses settings for which the device has no command. A range selects range modes, and a rate of 0 disables acoustics.
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  const Product& product = product_of(*device.model);
  const auto refused = [&](const std::string& text) { return failure(ErrorKind::usage, "a " + (product.name + (" " + text))); };
  Settings s = settings_from(device.settings.get());
  if (wanted.range_m) {
    const std::string why =
        protocol::range_complaint(*wanted.range_m, std::string("a ") + product.name, 0.05, product.highest_m, "range_mode");
    if (!why.empty()) return failure(ErrorKind::usage, why);
    allow_modes(range_mode_for(*wanted.range_m, product), s);
  }
  if (wanted.rate_hz && *wanted.rate_hz != 0)
    return refused("sets its rate by altitude; a rate of 0 disables its acoustics, the command set_config enables them");
  if (wanted.rate_hz) s.acoustics = s.is_triggered = false;
  if (wanted.gain_percent) return refused("sets its own gain");
  if (wanted.mode.value_or(0) != 0) return refused("has one mode, 0");
  if (wanted.beams.value_or(beam_count) != beam_count) return refused("has four beams");
  if (wanted.sample_bits || wanted.row_gains.value_or(false)) return refused("sends no samples");
  return change_to(s, device);
}

}  // namespace sonar::dvl
