// Computes a ping in paper or raster mode: rays, eq. (2), frequency sum, beam correction, inverse transform, samples. The
// result depends only on request and scene.
#pragma once

#include <memory>
#include <vector>

#include "core/base/random.hpp"
#include "core/paper/paper_signal.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "core/pipeline/simd/kernels.hpp"

namespace sonar::paper {

/// Values for one model with one set of settings, kept from ping to ping.
struct Prepared {
  Prepared(const PingRequest& request, FrequencySum sum);
  bool serves(const PingRequest& request) const;

  std::shared_ptr<const SonarModel> model;
  PingPlan plan;
  PaperFan fan;
  PaperSpectrum spectrum;
  std::unique_ptr<spectral::FrequencySums> fast;  // null: the sums are computed term by term
  InverseTransform inverse;
  std::unique_ptr<PulsePower> pulse_power;    // in expected power only
  std::unique_ptr<BeamTransformTables> even;  // the beam correction for uniform azimuths; null: `correction` is used
  std::vector<float> correction;              // panels of the beam correction, see panels_of
  std::vector<double> pattern;                // D(phi) of each row of a fan
  double elevation_per_sine = 0;              // D(phi) = sinc(elevation_per_sine sin phi); 0 = no pattern
};

/// D(phi) at an elevation phi.
double elevation_pattern(const Prepared& prepared, double elevation_rad);

/// Adds the echo of a scatterer with a known cross-section. Returns false if the echo lies outside the record.
bool add_echo(double range_m, double pattern, double cross_section_m2, ComplexNormal xi, const Prepared& prepared,
              const PingScalars& scalars, PaperEchoes& echoes);

/// Makes echoes of the hits of one column with eq. (2) and the terms of eq. (1), which are summed later. `mu`: by material. Hits
/// outside the record are dropped, as in the reference code.
void echoes_of(std::span<const PaperHit> hits, std::span<const double> mu, const Scene& scene, const Prepared& prepared,
               const PingScalars& scalars, const PingRequest& request, const simd::Kernels& kernels, PaperEchoes& echoes);

/// Computes the ping. The caller must have set the poses of moving bodies.
Ping simulate(const RayScene& scene, const PingRequest& request, const Prepared& prepared, const simd::Kernels& kernels,
              Parallel& pool, double (*now_s)(), PingStatistics& statistics);

}  // namespace sonar::paper
