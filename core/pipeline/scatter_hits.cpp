#include <algorithm>
#include <cmath>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/scatter.hpp"

namespace sonar {
namespace {

constexpr std::uint32_t fixed_fan_key = 0x66616eu;  // keeps these draws apart from the cells'

/// Of a ray of the fixed fan, sonar axes.
Vec3d direction_of_hit(const FanHit& hit, double sine, bool conical) {
  const ConicalDirection d{sine, static_cast<double>(hit.elevation_rad)};
  return conical ? sonar_from_conical(d) : sonar_from_flat(d);
}

/// Hits on their way to echoes, as many at a time as the kernels take.
class HitBatch {
 public:
  HitBatch(const Scene& scene, std::span<const LawTable> laws, const PingPlan& plan, const PingScalars& s, Seed seed,
           const simd::Kernels& kernels, Echoes& echoes)
      : scene_(scene), laws_(laws), plan_(plan), s_(s), kernels_(kernels), echoes_(echoes) {
    const auto bits = static_cast<std::uint64_t>(seed);
    sounding_.draw.counter[0] = object_, sounding_.draw.counter[1] = column_, sounding_.draw.counter[2] = ray_;
    sounding_.draw.last_counter = fixed_fan_key;
    sounding_.draw.key[0] = static_cast<std::uint32_t>(bits), sounding_.draw.key[1] = static_cast<std::uint32_t>(bits >> 32);
    sounding_.range_m = range_m_;
    sounding_.weight = weight_;
    sounding_.decay_per_m = static_cast<float>(2 * s.absorption_np_per_m);
    sounding_.turns_per_m = s.turns_per_m;
  }

  void add(const FanHit& hit) {
    const double r = static_cast<double>(hit.range_m);
    double at_sample = s_.sample_of(r);
    if (s_.doppler_m_per_mps != 0)
      at_sample += s_.doppler_samples(direction_of_hit(hit, plan_.columns.sine(hit.column), plan_.switches.conical));
    // Said so that what is not a number is left out, too.
    if (!(at_sample > -plan_.taps / 2 && at_sample < plan_.samples + plan_.taps / 2 - 1)) return;
    if (!(r >= nearest_scatterer_m && hit.cosine >= 0 && hit.cosine < 1.001f)) return;
    const Object& object = scene_.objects[hit.object];
    // sqrt(sigma) / r^2, sigma = strength * footprint_area_m2; the solid angle of a ray is in its weight.
    const float strength = laws_[object.mesh->material[hit.triangle]].root_strength(hit.cosine);
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
    if (++count_ == simd::HitsToSound::most) send();
  }

  void send() {
    if (echoes_.count + count_ > echoes_.capacity()) echoes_.reserve(std::max(1024, 2 * (echoes_.count + count_)));
    const simd::EchoArrays out = echoes_.at(echoes_.count);
    std::copy(sample_, sample_ + count_, out.sample);
    std::copy(column_, column_ + count_, out.column);
    if (plan_.expected_power)
      for (int i = 0; i < count_; ++i) {
        const float amplitude = weight_[i] * std::exp(-sounding_.decay_per_m * range_m_[i]);
        out.re[i] = amplitude * amplitude;
        out.im[i] = 0;
      }
    else
      kernels_.sound_hits(sounding_, count_, out.re, out.im);
    echoes_.count += count_;
    count_ = 0;
  }

 private:
  /// What the solid angle of a ray owes to its column: flat beams only.
  float column_weight(int column) {
    if (plan_.switches.conical) return 1;
    if (column != last_column_) {
      const double sine = plan_.columns.sine(column);
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
  simd::HitsToSound sounding_{};
  int count_ = 0, last_column_ = -1;
  float last_weight_ = 1;
  static constexpr int most = simd::HitsToSound::most;
  float sample_[most], range_m_[most], weight_[most];
  std::uint32_t object_[most], column_[most], ray_[most];
};

}  // namespace

void scatter_hits(std::span<const FanHit> hits, const Scene& scene, std::span<const LawTable> laws, const PingPlan& plan,
                  const PingScalars& s, Seed seed, const simd::Kernels& kernels, Echoes& echoes) {
  HitBatch batch(scene, laws, plan, s, seed, kernels, echoes);
  for (const FanHit& hit : hits) batch.add(hit);
  batch.send();
}

}  // namespace sonar
