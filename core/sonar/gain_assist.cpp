#include "core/sonar/gain_assist.hpp"

#include <algorithm>
#include <cmath>

namespace sonar {

namespace {

constexpr double saturated_level = 0.999;

/// False for logarithmic samples: next_gain_db() assumes that codes are a power of the amplitude.
bool is_assisted(const PingSettings& s) { return s.gain_assist && s.format.scale == SampleFormat::Scale::linear; }

}  // namespace

double percentile_of_full_scale(const Ping& ping, double share) {
  const SampleFormat& format = ping.request.settings.format;
  const auto bytes = static_cast<std::size_t>(format.bits / 8);
  const std::size_t count = ping.samples.size() / bytes;
  if (count == 0) return 0;
  // Samples are little-endian; the two highest bytes are enough.
  const std::size_t high = bytes - 1, low = bytes > 1 ? bytes - 2 : high;
  std::vector<std::uint32_t> histogram(bytes > 1 ? 65536 : 256, 0u);
  for (std::size_t i = 0; i < count; ++i) {
    const std::byte* sample = ping.samples.data() + i * bytes;
    const auto top = std::to_integer<std::size_t>(sample[high]);
    ++histogram[bytes > 1 ? 256 * top + std::to_integer<std::size_t>(sample[low]) : top];
  }
  const auto wanted = static_cast<std::size_t>(std::ceil(share * static_cast<double>(count)));
  std::size_t code = 0;
  for (std::size_t below = histogram[0]; below < wanted && code + 1 < histogram.size();) below += histogram[++code];
  const double unit = bytes > 2 ? std::ldexp(1.0, 8 * static_cast<int>(bytes - 2)) : 1.0;
  return std::min(1.0, static_cast<double>(code) * unit / static_cast<double>(format.max_code));
}

double next_gain_db(double gain_db, double level, double gamma, double passed_s, double overload_db) {
  const double least_level = 1e-3;  // limits the rise of the gain after a black picture
  double wanted_db = 20 / gamma * std::log10(assisted_level / std::max(level, least_level));
  if (level >= saturated_level) wanted_db -= overload_db;
  const double part = 1 - std::exp(-std::max(passed_s, 0.0) / assist_time_s);
  return std::clamp(gain_db + part * wanted_db, least_assisted_gain_db, most_assisted_gain_db);
}

float GainAssist::gain_db(const PingSettings& settings, Time at) {
  if (!is_assisted(settings)) {
    on_ = false;
    return settings.gain_db;
  }
  if (!on_ || mode_ != settings.mode) {
    on_ = true;
    has_seen_ = false;
    mode_ = settings.mode;
    gain_db_ = static_cast<double>(settings.gain_db);
    overload_db_ = 0;
  }
  if (has_seen_) {
    overload_db_ = level_ >= saturated_level ? std::clamp(2 * overload_db_, least_overload_db, most_overload_db) : 0;
    gain_db_ = next_gain_db(gain_db_, level_, gamma_, seconds(at - seen_at_), overload_db_);
  }
  has_seen_ = false;  // each picture counts once
  return static_cast<float>(gain_db_);
}

void GainAssist::look_at(const Ping& ping) {
  const PingSettings& made_with = ping.request.settings;
  if (!on_ || !is_assisted(made_with) || made_with.mode != mode_ || ping.request.blank) return;
  has_seen_ = true;
  level_ = percentile_of_full_scale(ping);
  gamma_ = static_cast<double>(made_with.format.gamma);
  seen_at_ = ping.request.fired_at;
}

}  // namespace sonar
