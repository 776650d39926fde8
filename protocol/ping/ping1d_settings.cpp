#include "protocol/ping/ping1d_settings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/base/geometry.hpp"
#include "protocol/limits.hpp"
#include "protocol/ping/one_beam.hpp"
#include "protocol/ping/products.hpp"

namespace sonar::ping::ping1d {
namespace {

using protocol::refused;

constexpr std::array<double, 7> gains{0.6, 1.8, 5.5, 12.9, 30.2, 66.1, 144};  // DEF: amplification of each gain_setting
static_assert(gains.size() == most_gain + 1);
constexpr int points = 200;                // from memory
constexpr std::uint32_t most_mm = 100000;  // MAN
constexpr double shortest_pulse_us = 26;   // USR: pulse at 1 m. unknown: pulses at longer ranges

SonarModel make_model() {
  FrequencyMode mode;
  mode.name = "115 kHz";
  mode.centre_hz = 115e3f;
  mode.min_range_m = static_cast<float>(nearest_echo_m);
  mode.max_range_m = 1e-3f * most_mm;
  mode.source_level_db = 190;  // unknown: level and full scale; set so that sand needs the lowest gain at 0.5 m
  mode.beam_spacing = BeamSpacing::listed;
  mode.beam_azimuths_rad = {0};
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(30));  // MAN; a newer edition has 25
  mode.pattern.elevation_width_rad = mode.pattern.azimuth_width_rad;
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(76));  // rays cover the main lobe down to -20 dB
  mode.receiver.full_scale_upa = 1.4e8f;
  SonarModel model;
  model.profile = "ping1d";
  model.name = "Ping1D";
  model.max_rate_hz = 1000;  // the rate of the shortest interval; the travel time of sound limits it further
  model.modes = {mode};
  return model;
}

std::uint32_t end_mm(const ScanRange& r) { return r.start_mm + r.length_mm; }

}  // namespace

std::span<const std::shared_ptr<const SonarModel>> models() { return protocol::only_model<make_model>(); }

bool same_settings(const Settings& a, const Settings& b) { return a.id == b.id && a.parameters == b.parameters; }

std::string complaint(const Parameters& p) {
  if (p.range.length_mm < shortest_range_mm || p.range.length_mm > most_mm || p.range.start_mm > most_mm ||
      end_mm(p.range) > most_mm)
    return protocol::range_rule(1e-3 * shortest_range_mm, 1e-3 * most_mm, "scan_start, scan_length");
  if (p.speed_mm_per_s < 1000000 || p.speed_mm_per_s > 2000000) return "speed_of_sound is not in 1000000..2000000";
  if (p.gain > most_gain) return "gain_setting is not in 0..6";
  if (p.mode_auto > 1) return "mode_auto must be 0 or 1";
  if (p.enable > 1) return "ping_enabled must be 0 or 1";
  return {};
}

std::uint16_t transmit_us(const Parameters& p) {
  const double us_of_point = 2e6 * p.range.length_mm / points / p.speed_mm_per_s;
  return static_cast<std::uint16_t>(std::lround(std::max(us_of_point, shortest_pulse_us)));
}

PingSettings ping_settings(const Settings& settings) {
  const Parameters& p = settings.parameters;
  const double speed_mps = 1e-3 * p.speed_mm_per_s;
  PingSettings s;
  s.beam_count = 1;
  s.range_bin_count = points;
  s.range_start_m = 1e-3 * p.range.start_mm;
  s.range_m = 1e-3 * end_mm(p.range);
  s.range_bin_m = 1e-3 * p.range.length_mm / points;
  s.samples_per_row = 4;
  s.pulse_width_m = static_cast<float>(1e-6 * transmit_us(p) * speed_mps / 2);
  s.rate_hz = p.enable == 0 ? 0 : 1000.0f / static_cast<float>(std::max<int>(p.interval_ms, 1));
  s.triggered = true;
  s.gain_db = static_cast<float>(20 * std::log10(gains[p.gain]));
  s.tvg = false;  // unknown: assumed, because the seven gains alone reach from the nearest bottom to the farthest
  s.device_sound_speed_mps = static_cast<float>(speed_mps);
  s.format = {.bits = 8, .max_code = 255};
  return s;
}

protocol::ChangeSettings change_to(const Settings& settings) {
  const PingSettings s = ping_settings(settings);
  const Parameters& p = settings.parameters;
  char text[160];
  std::snprintf(text, sizeof text, "%s, %s, %.2f to %.2f m, gain %d, at most %.4g Hz, sound speed %g m/s",
                p.enable != 0 ? "pings as requested" : "standby", p.mode_auto != 0 ? "automatic" : "manual", s.range_start_m,
                s.range_m, p.gain, static_cast<double>(s.rate_hz), static_cast<double>(s.device_sound_speed_mps));
  return {s, std::make_shared<HeldSettings>(settings), text};
}

Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  Settings s = settings_from(device.settings.get());
  Parameters& p = s.parameters;
  const double low_m = 1e-3 * (p.range.start_mm + shortest_range_mm);
  const std::string why =
      protocol::first_of({protocol::range_complaint(wanted, "a Ping1D", low_m, 1e-3 * most_mm, "scan_start + scan_length"),
                          protocol::rate_complaint(wanted, "a Ping1D", device.model->max_rate_hz, "ping_interval"),
                          protocol::gain_complaint(wanted), one_beam_complaint(wanted, "a Ping1D", 8)});
  if (!why.empty()) return refused(why);
  if (wanted.range_m) {
    p.range.length_mm = static_cast<std::uint32_t>(std::lround(1000 * *wanted.range_m)) - p.range.start_mm;
    p.mode_auto = 0;
  }
  if (wanted.rate_hz) {
    p.enable = *wanted.rate_hz > 0 ? 1 : 0;
    if (p.enable != 0) p.interval_ms = static_cast<std::uint16_t>(std::lround(period_ms(*wanted.rate_hz)));
  }
  if (wanted.gain_percent) {
    p.gain = static_cast<std::uint8_t>(std::lround(*wanted.gain_percent / 100 * most_gain));
    p.mode_auto = 0;
  }
  if (const std::string rule = complaint(p); !rule.empty()) return refused("Ping1D: " + rule);
  return change_to(s);
}

// The automatic mode always starts the range at the sonar.
Parameters adjusted(const Parameters& made_with, const Echo& echo) {
  Parameters p = made_with;
  const Reach next = ping::adjusted({made_with.range.length_mm, made_with.gain}, echo, {.gains = gains, .most_mm = most_mm});
  p.range = {0, next.length_mm};
  p.gain = static_cast<std::uint8_t>(next.gain);
  return p;
}

namespace {

Bytes frame_of(Results result, const Profile& profile, BytesView samples, std::uint8_t id) {
  if (result == simple_result)
    return framed_message(Id::ping1d_distance_simple, id,
                          DistanceSimple{profile.distance_mm, static_cast<std::uint8_t>(profile.confidence)});
  if (result == distance_result) return framed_message(Id::ping1d_distance, id, static_cast<const Distance&>(profile));
  Bytes payload = wire::bytes_of(profile);
  payload.insert(payload.end(), samples.begin(), samples.end());
  return framed(Id::ping1d_profile, id, payload);
}

}  // namespace

std::vector<Bytes> frames_of(const Ping& ping) {
  const Settings s = settings_from(ping.request.vendor_settings.get());
  const PingSettings& made = ping.request.settings;
  const Results results = s.results != no_result ? s.results : profile_result;
  const Echo echo = echo_in(ping);
  Profile profile;
  profile.distance_mm = static_cast<std::uint32_t>(std::lround(1000 * echo.range_m));
  profile.confidence = static_cast<std::uint16_t>(echo.confidence);
  profile.ping = static_cast<std::uint32_t>(ping.request.number);
  // Range, pulse and gain are those with which the ping was made; the present values may differ.
  profile.start_mm = static_cast<std::uint32_t>(std::lround(1000 * made.range_start_m));
  profile.length_mm = static_cast<std::uint32_t>(std::lround(1000 * (made.range_m - made.range_start_m)));
  profile.transmit_us = static_cast<std::uint16_t>(
      std::lround(2e6 * static_cast<double>(made.pulse_width_m) / static_cast<double>(made.device_sound_speed_mps)));
  const double gain = std::pow(10, static_cast<double>(made.gain_db) / 20);
  profile.gain = static_cast<std::uint32_t>(std::lower_bound(gains.begin(), gains.end() - 1, 0.99 * gain) - gains.begin());
  profile.count = static_cast<std::uint16_t>(ping.samples.size());
  std::vector<Bytes> frames;
  for (const Results one : {simple_result, distance_result, profile_result})
    if ((results & one) != 0) frames.push_back(frame_of(one, profile, ping.samples, s.id));
  return frames;
}

std::vector<Bytes> answer(BytesView recorded, Results wanted) {
  const auto frame = whole_frame(recorded);
  if (!frame) return {};
  Profile profile;
  wire::Reader reader(frame->payload);
  if (frame->header.id == Id::ping1d_distance_simple) {
    DistanceSimple simple;
    fields(reader, simple);
    profile.distance_mm = simple.distance_mm;
    profile.confidence = simple.confidence;
  } else {
    fields(reader, static_cast<Distance&>(profile));
  }
  const Results own = results_of(frame->header.id);
  if (!reader.ok() || own == no_result) return {};
  return messages_for(wanted, recorded, own, [&](Results one) { return frame_of(one, profile, {}, frame->header.source); });
}

}  // namespace sonar::ping::ping1d
