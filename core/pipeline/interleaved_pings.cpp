#include "core/pipeline/interleaved_pings.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "core/pipeline/interference.hpp"
#include "core/pipeline/ping_scalars.hpp"

namespace sonar {
namespace {

/// Copies the values of the beams that a ping formed. Values are [rows][beams] with `size` elements each.
template <class Values>
void take_beams(const Values& from, std::size_t beams, BeamChoice own, std::size_t size, Values& to) {
  if (from.size() != to.size()) return;
  const auto first = static_cast<std::size_t>(own.first), step = static_cast<std::size_t>(own.step);
  for (std::size_t row = 0; row < to.size(); row += beams * size)
    for (std::size_t at = row + first * size; at < row + beams * size; at += step * size)
      std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(at), size, to.begin() + static_cast<std::ptrdiff_t>(at));
}

}  // namespace

int pings_in(const PingRequest& picture) {
  return picture.switches.interleave ? picture.model->modes[static_cast<std::size_t>(picture.settings.mode)].interleaved_pings
                                     : 1;
}

std::vector<PingRequest> pings_of(const PingRequest& picture) {
  const int count = pings_in(picture);
  const Twist& twist = picture.sonar_moves;
  const bool moves = picture.switches.motion && (length(twist.velocity_mps) > 0 || length(twist.angular_rate_radps) > 0);
  std::vector<PingRequest> pings(static_cast<std::size_t>(count), picture);
  for (int p = 0; p < count && count > 1; ++p) {
    PingRequest& ping = pings[static_cast<std::size_t>(p)];
    const double later_s = p * picture.settings.ping_interval_s;
    ping.number = static_cast<PingNumber>(static_cast<std::uint32_t>(picture.number) * static_cast<std::uint32_t>(count) +
                                          static_cast<std::uint32_t>(p));
    ping.fired_at += nanoseconds_from(later_s);
    if (moves) ping.sonar_in_world = propagate(picture.sonar_in_world, twist, later_s);
  }
  return pings;
}

BeamChoice beams_of(const PingRequest& picture, std::size_t p) {
  // The last beam comes from the first ping.
  const int count = pings_in(picture), last = picture.settings.beam_count - 1;
  return {(last + count - static_cast<int>(p)) % count, count};
}

std::vector<ColumnRange> columns_of(const PingPlan& plan, BeamChoice beams) {
  const BeamWeights& of = plan.beam_weights;
  if (beams.is_all() || of.transform || plan.beam_mix.blurs() || plan.beam_mix.blends() ||
      Crosstalk(plan, plan.switches).is_audible())
    return {{0, plan.columns.count}};
  std::vector<bool> used(static_cast<std::size_t>(plan.columns.count));
  for (const BeamPanel& panel : of.panels)
    for (int j = panel.first_beam; j < panel.first_beam + 4; ++j)
      for (int k = 0; beams.has(j) && k < panel.count; ++k)
        if (of.weights[panel.weights + static_cast<std::size_t>(4 * k + j - panel.first_beam)] != 0)
          used[static_cast<std::size_t>(panel.first_column + k)] = true;
  std::vector<ColumnRange> ranges;
  for (int k = 0; k < plan.columns.count; ++k) {
    if (!used[static_cast<std::size_t>(k)]) continue;
    if (ranges.empty() || ranges.back().last < k) ranges.push_back({k, k});
    ranges.back().last = k + 1;
  }
  return ranges;
}

Ping interleaved(const PingRequest& picture, std::span<Ping> pings) {
  const std::size_t beams = static_cast<std::size_t>(picture.settings.beam_count);
  Ping whole = std::move(pings.front());
  const bool blank = whole.request.blank;
  whole.request = picture;
  whole.request.blank = blank;
  if (pings.size() == 1) return whole;
  std::shared_ptr<PingLabels> labels = whole.labels ? std::make_shared<PingLabels>(*whole.labels) : nullptr;
  for (std::size_t p = 1; p < pings.size(); ++p) {
    const BeamChoice own = beams_of(picture, p);
    const auto take = [&](const auto& from, std::size_t size, auto& to) { take_beams(from, beams, own, size, to); };
    take(pings[p].samples, static_cast<std::size_t>(picture.settings.format.bits / 8), whole.samples);
    take(pings[p].pressure_upa, 1, whole.pressure_upa);
    take(pings[p].beam_signal_upa, 1, whole.beam_signal_upa);
    take(pings[p].truth, 1, whole.truth);
    if (!labels || !pings[p].labels) continue;
    take(pings[p].labels->instance, 1, labels->instance);
    take(pings[p].labels->share, 1, labels->share);
    take(pings[p].labels->caster, 1, labels->caster);
  }
  whole.labels = std::move(labels);
  return whole;
}

}  // namespace sonar
