// Converts a SettingsOverride to the SET_ACOUSTICS that a controller would send for it.
#include <algorithm>
#include <cmath>

#include "protocol/aris/settings.hpp"
#include "protocol/limits.hpp"

namespace sonar::aris {
namespace {

constexpr std::uint32_t shortest_period_us = 4, longest_period_us = 100, longest_pulse_us = 80;

tl::unexpected<Error> refused(std::string text) { return failure(ErrorKind::usage, std::move(text)); }

/// Sets the wanted mode, or else the ping mode with the wanted number of beams.
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
  std::string counts;
  for (const PingMode& mode : product.ping_modes) {
    counts += (counts.empty() ? "" : " or ") + std::to_string(mode.beams());
    if (mode.beams() != static_cast<int>(*wanted.beams)) continue;
    s.acoustics.ping_mode = mode.number;
    return {};
  }
  return refused(device.model->name + " forms " + counts + " beams" + asked);
}

/// Changes the end of the window and keeps its start. Keeps the sample period too if the resulting number of samples is valid.
/// Makes the pulse at least as long as the sample period.
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
  a.pulse_us = std::max(a.pulse_us, std::min(a.sample_period_us, longest_pulse_us));  // judge() limits it
  return {};
}

}  // namespace

Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  Settings s = settings_from(device.settings.get(), device);
  if (auto r = set_mode(s, wanted, device); !r) return tl::make_unexpected(r.error());
  if (wanted.range_m)
    if (auto r = set_range(s, *wanted.range_m, device); !r) return tl::make_unexpected(r.error());
  Acoustics& a = s.acoustics;
  if (wanted.rate_hz) {
    if (*wanted.rate_hz < 1 || *wanted.rate_hz > highest_rate_hz)
      return refused("the rate of an ARIS is 1 to 15 Hz; only a controller can stop it");
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
  // judge() refuses a cookie of 0, which the settings have before a controller has sent any.
  Acoustics numbered = a;
  numbered.cookie = std::max(a.cookie, 1u);
  const Verdict verdict = judge(numbered, product, true);
  if (!verdict.refusal.empty()) return refused(device.model->name + ": " + verdict.refusal);
  a.pulse_us = verdict.used.pulse_us;
  return change_to(s, device);
}

}  // namespace sonar::aris
