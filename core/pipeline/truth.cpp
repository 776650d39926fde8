#include "core/pipeline/truth.hpp"

#include <algorithm>
#include <cmath>

#include "core/pipeline/arithmetic/beam_pattern.hpp"

namespace sonar {
namespace {

/// Replaces `nearest` if this hit is nearer. Ranges are along the ray.
void note(float range_m, std::uint32_t object, BeamTruth& nearest) {
  if (nearest.object != BeamTruth::nothing && nearest.range_m <= range_m) return;
  nearest = {range_m, object};
}

}  // namespace

float truth_half_width_rad(const PingPlan& plan) {
  const BeamPattern& pattern = plan.mode.pattern;
  // Without a pattern, the data sheet's width is used.
  if (pattern.elevation_taper == Taper::unit) return pattern.elevation_width_rad / 2;
  // The |psi| [rad] at which D_v of eq. 34 has fallen to sqrt(1/2) in amplitude, -3 dB.
  return static_cast<float>(elevation_reach_rad(pattern, std::sqrt(0.5)));
}

void note_first_hits(const FanScratch& fan, const PingPlan& plan, int first, int last, std::span<BeamTruth> by_column) {
  const float widest = truth_half_width_rad(plan);
  const auto elevations = static_cast<std::int32_t>(plan.fan.elevation_rad.size());
  for (int k = first; k < last; ++k) {
    BeamTruth& nearest = by_column[static_cast<std::size_t>(k)];
    // Samples are linked from bottom to top. The first sample of a column is its lowest base ray.
    for (std::int32_t i = (k - first) * elevations; i >= 0; i = fan.samples[static_cast<std::size_t>(i)].next) {
      const FanScratch::Sample& s = fan.samples[static_cast<std::size_t>(i)];
      if (s.surface.object != RayPacket::miss && std::abs(s.elevation_rad) <= widest)
        note(s.surface.range_m, s.surface.object, nearest);
    }
  }
}

void note_first_hits(std::span<const FanHit> hits, const PingPlan& plan, std::span<BeamTruth> by_column) {
  const float widest = truth_half_width_rad(plan);
  for (const FanHit& hit : hits)
    if (std::abs(hit.elevation_rad) <= widest) note(hit.range_m, hit.object, by_column[static_cast<std::size_t>(hit.column)]);
}

std::vector<BeamTruth> truth_of_beams(const PingPlan& plan, std::span<const BeamTruth> by_column) {
  std::vector<BeamTruth> truth;
  truth.reserve(plan.beam_sine.size());
  for (const double sine : plan.beam_sine) {
    // The column whose u is nearest to the beam. The clamp corrects rounding at the outermost columns.
    const long column = std::lround((plan.columns.first_sine - sine) / plan.columns.spacing);
    truth.push_back(by_column[static_cast<std::size_t>(std::clamp<long>(column, 0, plan.columns.count - 1))]);
  }
  return truth;
}

}  // namespace sonar
