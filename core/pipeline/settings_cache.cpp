#include "core/pipeline/settings_cache.hpp"

#include <algorithm>
#include <set>

#include "core/sonar/bearings.hpp"

namespace sonar {
namespace {

/// Approximate size of a plan in memory.
std::size_t bytes_of(const PingPlan& p) {
  const auto of = [](const auto&... all) { return (... + (sizeof(all[0]) * all.capacity())); };
  std::size_t bytes = p.shared_noise.bytes() + p.beam_mix.bytes();
  if (p.beam_weights.transform) bytes += p.beam_weights.transform->bytes();
  if (p.spectral) bytes += p.spectral->bytes();
  return bytes + of(p.fixed_fan_rays, p.columns.transmit, p.fan.tangent, p.fan.elevation_rad, p.beam_weights.panels,
                    p.beam_weights.weights, p.beam_azimuth_rad, p.beam_sine, p.beam_pattern, p.pulse_rows, p.levels, p.elevation,
                    p.pulse_filter, p.noise_filter, p.noise_profile.far, p.noise_profile.near_less_far, p.noise_profile.decay,
                    p.row_power_factor, p.row_gain, p.beam_power_factor);
}

}  // namespace

PreparedSettings& SettingsCache::prepared_for(const PingRequest& request, const Scene& scene, Parallel& pool) {
  auto it = std::find_if(prepared_.begin(), prepared_.end(),
                         [&](const auto& p) { return p->model == request.model && serves(p->plan, request); });
  const bool is_new = it == prepared_.end();
  if (is_new) {
    auto made = std::make_unique<PreparedSettings>();
    made->model = request.model;
    made->plan = make_plan(request.model->modes[static_cast<std::size_t>(request.settings.mode)], request.settings,
                           request.switches, pool, bearing_scale_of(request));
    it = prepared_.insert(prepared_.end(), std::move(made));
  }
  PreparedSettings& p = **it;
  p.last_used = ++uses_;
  set_gain(p.plan, request.settings.gain_db);
  // Leak and volume have the pulse's correlation. A table is made again only if the seed or the filter changes.
  const bool volume = request.switches.volume && scene.water_column.has_volume();
  const bool leak = request.switches.leak && p.plan.mode.receiver.leak_upa > 0;
  if (!p.plan.expected_power) {
    std::vector<const NoiseTable*> drawn;  // tables to share: settings that differ only in range have the same filter
    for (const auto& other : prepared_) drawn.insert(drawn.end(), {&other->noise, &other->grains});
    if (request.switches.noise || ((leak || volume) && p.one_table())) p.noise.prepare(request.seed, p.plan.noise_filter, drawn);
    if ((leak || volume) && !p.one_table()) p.grains.prepare(request.seed, p.plan.pulse_filter, drawn);
  }
  if (is_new) forget_others(p);
  return p;
}

std::size_t SettingsCache::bytes() const {
  std::size_t bytes = 0;
  std::set<const void*> counted;
  for (const auto& p : prepared_) {
    bytes += sizeof(PreparedSettings) + bytes_of(p->plan);
    for (const NoiseTable* table : {&p->noise, &p->grains}) bytes += table->bytes(counted);
  }
  return bytes;
}

void SettingsCache::forget_others(const PreparedSettings& in_use) {
  while (prepared_.size() > 1 && bytes() > most_bytes_) {
    const auto oldest = std::min_element(prepared_.begin(), prepared_.end(),
                                         [](const auto& a, const auto& b) { return a->last_used < b->last_used; });
    if (oldest->get() == &in_use) return;
    prepared_.erase(oldest);
  }
}

}  // namespace sonar
