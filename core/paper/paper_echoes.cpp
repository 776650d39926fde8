#include <algorithm>
#include <cmath>

#include "core/base/random.hpp"
#include "core/paper/paper_ping.hpp"
#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"

namespace sonar::paper {

namespace {

/// The delay divided by the record's length. The record begins at the near edge of the picture.
double turns_of(double range_m, const Prepared& p, const PingScalars& s) {
  // The delay in periods of the record, because the sum over frequencies of Choi 2025 (its eq. 4) repeats after T.
  return (range_m * s.samples_per_m - p.plan.start_samples) / p.plan.samples;
}

}  // namespace

double elevation_pattern(const Prepared& p, double elevation_rad) {
  // One sinc pattern of the quoted width, sinc(0.884 sin(phi) / width) (docs/acoustics.md, section 8).
  return p.elevation_per_sine > 0 ? sinc(p.elevation_per_sine * std::sin(elevation_rad)) : 1.0;
}

bool add_echo(double range_m, double pattern, double cross_section_m2, ComplexNormal xi, const Prepared& p, const PingScalars& s,
              PaperEchoes& echoes) {
  const double turns = turns_of(range_m, p, s);
  // An echo outside the record is dropped, because the sum would fold it back into the record.
  if (!(turns >= 0 && turns < 1)) return false;
  // Choi 2025, eq. 1: sqrt(cross-section) D(phi) e^{-2 a r} / r^2 times the source.
  const double amplitude =
      s.source_upa * std::sqrt(cross_section_m2) * pattern * two_way_transmission(range_m, s.absorption_np_per_m);
  // In expected-power mode, eq. 39 applies; otherwise the factor xi and the phase of eq. 12.
  if (p.plan.expected_power)
    echoes.push_back({turns, {amplitude * amplitude, 0}});
  else
    echoes.push_back({turns, spectral::Complex(static_cast<double>(xi.re), static_cast<double>(xi.im)) *
                                 std::polar(amplitude, -2 * pi * fraction_of_turn(range_m * s.turns_per_m))});
  return true;
}

void echoes_of(std::span<const PaperHit> hits, std::span<const double> mu, const Scene& scene, const Prepared& p,
               const PingScalars& s, const PingRequest& request, const simd::Kernels& kernels, PaperEchoes& echoes) {
  const auto pattern_of = [&](const PaperHit& hit) {
    return p.pattern.empty() ? elevation_pattern(p, hit.elevation_rad) : p.pattern[static_cast<std::size_t>(hit.row)];
  };
  const auto mu_of = [&](const PaperHit& hit) { return mu[scene.objects[hit.object].mesh->material[hit.triangle]]; };
  // The mean over speckle: |xi|^2 = 1, and powers add.
  if (p.plan.expected_power) {
    for (const PaperHit& hit : hits)
      add_echo(hit.range_m, pattern_of(hit), printed_cross_section_m2(mu_of(hit), hit.cosine, hit.range_m, hit.solid_angle_sr),
               {}, p, s, echoes);
    return;
  }
  constexpr std::size_t most = simd::HitsToScatter::most;
  std::uint32_t number[most], column[most], row[most];
  float range[most], weight[most], re[most], im[most];
  // Speckle is drawn for each (ping, column, row).
  std::fill_n(number, most, static_cast<std::uint32_t>(request.number));
  simd::HitsToScatter arguments{{{number, column, row}, key_of(request.seed, Domain::paper_speckle)},
                                range,
                                weight,
                                static_cast<float>(2 * s.absorption_np_per_m),
                                s.turns_per_m};
  int n = 0;
  // A full batch goes to the kernel, which applies the carrier, the absorption and the draw.
  const auto send = [&] {
    kernels.scatter_hits(arguments, n, re, im);
    for (int i = 0; i < n; ++i) echoes.push_back({turns_of(static_cast<double>(range[i]), p, s), {re[i], im[i]}});
    n = 0;
  };
  for (const PaperHit& hit : hits) {
    const double turns = turns_of(hit.range_m, p, s);
    if (!(turns >= 0 && turns < 1)) continue;
    const bool audible = hit.range_m >= nearest_scatterer_m;
    // The amplitude contains sqrt(printed_cross_section_m2) / r^2.
    const double amplitude =
        s.source_upa * std::sqrt(mu_of(hit) * hit.solid_angle_sr) * hit.cosine * pattern_of(hit) / hit.range_m;
    // Choi 2025, eq. 2 as printed: cos^2(incidence) times the footprint r^2 dOmega, without 1 / cos.
    range[n] = static_cast<float>(hit.range_m);
    weight[n] = audible ? static_cast<float>(amplitude) : 0;
    column[n] = static_cast<std::uint32_t>(hit.column);
    row[n] = static_cast<std::uint32_t>(hit.row);
    if (++n == static_cast<int>(most)) send();
  }
  send();
}

}  // namespace sonar::paper
