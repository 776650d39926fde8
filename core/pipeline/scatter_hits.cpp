#include <algorithm>
#include <cmath>

#include "core/base/random.hpp"
#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/scatter.hpp"

namespace sonar {
namespace {

/// Returns the direction of a ray of the fixed fan, in sonar axes.
Vec3d direction_of_hit(const FanHit& hit, double sine, bool conical) {
  const ConicalDirection d{sine, static_cast<double>(hit.elevation_rad)};
  return conical ? sonar_from_conical(d) : sonar_from_flat(d);
}

// Equation (6) has one scatterer for each ray. The footprint of a ray has the area r^2 dOmega / cos(alpha), so
// sigma = sigma_b r^2 dOmega / cos(alpha) and sqrt(sigma) / r^2 = sqrt(sigma_b dOmega / cos(alpha)) / r.
/// Converts hits to echoes, as many at a time as the kernels accept.
class HitBatch {
 public:
  HitBatch(const PingContext& context, Seed seed, Echoes& echoes)
      : scene_(context.scene()),
        laws_(context.laws),
        plan_(context.plan),
        s_(context.scalars),
        kernels_(context.kernels),
        echoes_(echoes) {
    // The draw is a function of (seed, object, column, ray). It is equal in every ping and for every number of threads.
    const RandomKey key = key_of(seed, Domain::fixed_fan);
    arguments_.draw.counter[0] = object_, arguments_.draw.counter[1] = column_, arguments_.draw.counter[2] = ray_;
    arguments_.draw.key = key;
    arguments_.range_m = range_m_;
    arguments_.weight = weight_;
    arguments_.decay_per_m = static_cast<float>(2 * s_.absorption_np_per_m);
    arguments_.turns_per_m = s_.turns_per_m;
  }

  void add(const FanHit& hit) {
    const double r = static_cast<double>(hit.range_m);
    double at_sample = s_.sample_of(r);
    if (s_.doppler_m_per_mps != 0)
      at_sample += s_.doppler_samples(direction_of_hit(hit, plan_.columns.sine(hit.column), plan_.switches.conical));
    // The condition also drops NaN.
    if (!(at_sample > -plan_.taps / 2 && at_sample < plan_.samples + plan_.taps / 2 - 1)) return;
    if (!(r >= nearest_scatterer_m && hit.cosine >= 0 && hit.cosine < 1.001f)) return;
    const Object& object = scene_.objects[hit.object];
    // The weight is the source's pressure times sqrt(sigma) / r^2. The weight of the ray contains the root of its solid angle.
    const float strength = laws_[object.mesh->material[hit.triangle]].root_strength(hit.cosine);
    // cosine_floor limits the footprint of a facet that is seen edge-on.
    const float slant = std::sqrt(std::max(hit.cosine, static_cast<float>(cosine_floor)));
    const float weight = static_cast<float>(s_.source_upa) * strength *
                         plan_.fixed_fan_rays[static_cast<std::size_t>(hit.ray)].weight / (slant * hit.range_m) *
                         column_weight(hit.column);
    sample_[count_] = static_cast<float>(at_sample);
    range_m_[count_] = hit.range_m;
    weight_[count_] = weight;
    object_[count_] = hit.object;
    column_[count_] = static_cast<std::uint32_t>(hit.column);
    ray_[count_] = static_cast<std::uint32_t>(hit.ray);
    if (++count_ == simd::HitsToScatter::most) send();
  }

  void send() {
    if (echoes_.count + count_ > echoes_.capacity()) echoes_.reserve(std::max(1024, 2 * (echoes_.count + count_)));
    const simd::EchoArrays out = echoes_.at(echoes_.count);
    std::copy(sample_, sample_ + count_, out.sample);
    std::copy(column_, column_ + count_, out.column);
    if (plan_.expected_power)
      for (int i = 0; i < count_; ++i) {
        // The amplitude falls by the two-way absorption e^{-2 a r}. Its square is the power's mean over the random draws.
        const float amplitude = weight_[i] * std::exp(-arguments_.decay_per_m * range_m_[i]);
        out.re[i] = amplitude * amplitude;
        out.im[i] = 0;
      }
    else
      kernels_.scatter_hits(arguments_, count_, out.re, out.im);
    echoes_.count += count_;
    count_ = 0;
  }

 private:
  /// Returns the part of a ray's weight that depends on its column; only flat beams have one. Their solid angle is
  /// dOmega = cos(psi) dtheta dpsi, with u = sin(theta).
  float column_weight(int column) {
    if (plan_.switches.conical) return 1;
    if (column != last_column_) {
      const double sine = plan_.columns.sine(column);
      // Weights are amplitudes, hence the root of dtheta = du / cos(theta).
      last_weight_ = static_cast<float>(1 / std::sqrt(std::sqrt(1 - sine * sine)));
      last_column_ = column;
    }
    return last_weight_;
  }

  const Scene& scene_;
  std::span<const LawTable> laws_;
  const PingPlan& plan_;
  const PingScalars& s_;
  const simd::Kernels& kernels_;
  Echoes& echoes_;
  simd::HitsToScatter arguments_{};
  int count_ = 0, last_column_ = -1;
  float last_weight_ = 1;
  static constexpr int most = simd::HitsToScatter::most;
  float sample_[most], range_m_[most], weight_[most];
  std::uint32_t object_[most], column_[most], ray_[most];
};

}  // namespace

void scatter_hits(const PingContext& context, std::span<const FanHit> hits, Seed seed, Echoes& echoes) {
  HitBatch batch(context, seed, echoes);
  for (const FanHit& hit : hits) batch.add(hit);
  batch.send();
}

}  // namespace sonar
