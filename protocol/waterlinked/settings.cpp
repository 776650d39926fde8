#include "protocol/waterlinked/settings.hpp"

#include <array>

#include "protocol/limits.hpp"

namespace sonar::waterlinked {
namespace {

constexpr std::uint32_t least_strength = 31;  // the lowest strength whose pixel is not 0
constexpr float first_gain_db = 33;           // initial gain of the gain assist, with which poles of 2 cm are visible at 8 m

}  // namespace

// The values of the model of the image (protocol/waterlinked/README.md); settings.hpp has their evidence.
HeldSettings::HeldSettings(const Settings& s) : settings(s) {
  beam_height_rad = rad_from_deg(mode_rows()[s.mode].beam_height_deg);
  range_unit_m = pixel_scale_m;
  RangeImageSettings::least_strength = waterlinked::least_strength;
  chosen_as_heard = true;
  RangeImageSettings::range_of_loudest = waterlinked::range_of_loudest;
  RangeImageSettings::range_sample_m = waterlinked::range_sample_m;
  RangeImageSettings::block_rows = waterlinked::block_rows;
  RangeImageSettings::least_confirming = waterlinked::least_confirming;
  RangeImageSettings::confirming_m = waterlinked::confirming_m;
  RangeImageSettings::median_passes = waterlinked::median_passes;
}

bool HeldSettings::equals(const VendorSettings& other) const {
  const auto* of = dynamic_cast<const HeldSettings*>(&other);
  return of != nullptr && settings == of->settings;
}

Settings initial_settings(const protocol::DeviceState& device) {
  Settings s;
  s.acoustics = text_option(device.options, option_name::acoustics_at_start) == "enabled";
  s.udp = text_option(device.options, option_name::udp_at_start);
  return s;
}

Settings settings_from(const VendorSettings* held, const protocol::DeviceState& device) {
  const auto* of = dynamic_cast<const HeldSettings*>(held);
  return of != nullptr ? of->settings : initial_settings(device);
}

PingSettings ping_settings(const Settings& settings, const protocol::DeviceState& device) {
  const ModeRow& mode = mode_rows()[settings.mode];
  PingSettings s;
  s.mode = static_cast<int>(settings.mode);
  s.beam_count = columns;
  s.range_bin_count = rows;
  s.range_m = settings.range_max_m;
  s.range_start_m = settings.range_min_m;
  s.range_bin_m = (s.range_m - s.range_start_m) / rows;
  s.pulse_width_m = static_cast<float>(mode.range_cell_m);
  // The device makes images only while acoustics are enabled and there is a receiver. A rate below that of the mode is from an
  // override, which may have been made in a faster mode.
  const bool sends = settings.acoustics && settings.udp != disabled;
  const float rate_hz = settings.rate_hz > 0 ? std::min(static_cast<float>(settings.rate_hz), mode.rate_hz) : mode.rate_hz;
  s.rate_hz = sends ? rate_hz : 0;
  s.gain_db = first_gain_db;
  s.gain_assist = true;
  double speed = settings.speed_of_sound_mps;
  if (speed == 0) {
    const Water believed{device.water.temperature_c, settings.fresh ? 0.0 : 35.0, device.water.ph, 0};
    speed = true_sound_speed_mps(believed, device.depth_m);
  }
  s.device_sound_speed_mps = static_cast<float>(speed);
  s.format = {.bits = 32, .max_code = range_image_max_code(full_scale_strength)};
  return s;
}

protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device) {
  const PingSettings s = ping_settings(settings, device);
  char text[160];
  std::snprintf(text, sizeof text, "acoustics %s, %s, %g to %g m, speed of sound %g m/s, UDP %s",
                settings.acoustics ? "on" : "off", mode_rows()[settings.mode].name, settings.range_min_m, settings.range_max_m,
                settings.speed_of_sound_mps, settings.udp.c_str());
  return {s, std::make_shared<HeldSettings>(settings), text, receivers_of(settings)};
}

// The address was checked when it was posted (http.cpp).
protocol::SetReceivers receivers_of(const Settings& settings) {
  if (settings.udp == multicast) return {{multicast_group}};
  if (settings.udp == unicast) return {{{*text::parse_ipv4(settings.unicast_ip), settings.unicast_port}}};
  return {};
}

Time device_time(Time at, const Settings& settings, const protocol::DeviceState& device) {
  if (text_option(device.options, option_name::clock) == "utc") return at;
  return Time(at - device.powered_up_at + settings.clock_offset);
}

Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  using protocol::refused;
  Settings s = settings_from(device.settings.get(), device);
  if (wanted.mode && *wanted.mode >= mode_rows().size())
    return refused("Sonar 3D-15 has 2 mode(s), counted from 0; no mode " + std::to_string(*wanted.mode));
  s.mode = wanted.mode.value_or(static_cast<std::uint32_t>(s.mode));
  if (wanted.range_m) {
    const std::string why =
        protocol::range_complaint(*wanted.range_m, "a Sonar 3D-15", s.range_min_m + least_window_m, longest_range_m);
    if (!why.empty()) return refused(why);
    s.range_max_m = *wanted.range_m;
  }
  const auto most_hz = static_cast<float>(mode_rows()[s.mode].rate_hz);
  const std::string in_mode = "a Sonar 3D-15 in mode " + std::string(mode_rows()[s.mode].name);
  if (const std::string why = protocol::rate_complaint(wanted, in_mode, most_hz); !why.empty()) return refused(why);
  if (wanted.rate_hz) {
    s.acoustics = *wanted.rate_hz > 0;
    s.rate_hz = *wanted.rate_hz < static_cast<double>(most_hz) ? *wanted.rate_hz : 0;
  }
  if (wanted.gain_percent) return refused("a Sonar 3D-15 sets its own gain");
  if (wanted.beams && *wanted.beams != columns) return refused("a Sonar 3D-15 has 256 columns");
  if (wanted.sample_bits || wanted.row_gains.value_or(false)) return refused("a Sonar 3D-15 has one format of its images");
  return change_to(s, device);
}

std::span<const protocol::Option> options() {
  static const std::array<protocol::Option, 5> all{{
      {option_name::release,
       {"1.8.0", "1.7.1", "1.7.0", "1.6.0"},
       "1.8.0",
       "release of the device's software, which decides the paths of its HTTP API"},
      {option_name::rip, {"2", "1"}, "2", "version of the range image protocol; 1 is without compression"},
      {option_name::acoustics_at_start, {"disabled", "enabled"}, "disabled", "acoustics before a client sets them"},
      {option_name::udp_at_start, {"disabled", "multicast"}, "disabled", "output of images before a client sets it"},
      {option_name::clock, {"utc", "since_boot"}, "utc", "since_boot: time stamps begin at 1970, as before NTP"},
  }};
  return all;
}

}  // namespace sonar::waterlinked
