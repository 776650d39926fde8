#include "protocol/mavlink/paired_poses.hpp"

#include <algorithm>

namespace sonar::mavlink {
namespace {

/// Interpolates linearly along the shorter way, because attitudes of one vehicle are close to each other.
Quatd between(Quatd a, Quatd b, double u) {
  const double sign = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z < 0 ? -u : u;
  const double rest = 1 - u;
  const Quatd q{rest * a.w + sign * b.w, rest * a.x + sign * b.x, rest * a.y + sign * b.y, rest * a.z + sign * b.z};
  return norm_squared(q) > 0 ? normalized(q) : a;
}

}  // namespace

void Attitudes::put(const AttitudeReading& reading) {
  if (!readings_.empty() && reading.at_ms < readings_.back().at_ms) return;  // it arrived late; the readings are in order of time
  if (!readings_.empty() && reading.at_ms == readings_.back().at_ms) readings_.pop_back();
  readings_.push_back(reading);
  if (readings_.size() > most) readings_.pop_front();
}

Attitudes::Answer Attitudes::at(std::int64_t at_ms, AttitudeReading& out) const {
  if (readings_.empty()) return Answer::later;
  const auto after = std::lower_bound(readings_.begin(), readings_.end(), at_ms,
                                      [](const AttitudeReading& r, std::int64_t t) { return r.at_ms < t; });
  if (after == readings_.end()) {  // later than the newest reading: extrapolates for a short time
    const AttitudeReading& last = readings_.back();
    const std::int64_t ahead_ms = at_ms - last.at_ms;
    if (ahead_ms > longest_carry_ms) return Answer::later;
    out = last;
    out.at_ms = at_ms;
    if (is_finite(last.rates_radps))
      out.frd_in_ned = last.frd_in_ned * turned_by(1e-3 * static_cast<double>(ahead_ms) * last.rates_radps);
    return Answer::known;
  }
  if (after->at_ms == at_ms) {
    out = *after;
    return Answer::known;
  }
  if (after == readings_.begin()) return Answer::never;
  const AttitudeReading& before = *std::prev(after);
  const std::int64_t gap_ms = after->at_ms - before.at_ms;
  if (gap_ms > longest_gap_ms) return Answer::never;
  const double u = static_cast<double>(at_ms - before.at_ms) / static_cast<double>(gap_ms);
  out = {at_ms, between(before.frd_in_ned, after->frd_in_ned, u), (1 - u) * before.rates_radps + u * after->rates_radps};
  return Answer::known;
}

}  // namespace sonar::mavlink
