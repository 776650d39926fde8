// Traces rays, and computes beams from their hits as printed in Choi 2025 (Sensors 25(5):1516, "P25"): eq. (1)-(4) for each
// column, the beamforming of the reference code, and an inverse transform. docs/acoustics.md, section 8, lists the differences
// from the canonical model.
#pragma once

#include <cmath>
#include <complex>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/pipeline/form_beams.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/ping_scalars.hpp"
#include "core/pipeline/plan_tables.hpp"
#include "core/pipeline/pulses/spectral.hpp"
#include "core/pipeline/simd/kernels.hpp"
#include "core/scene/ray_scene.hpp"

namespace sonar::paper {

// The first stage traces the rays of the two comparison modes. Each ray that hits a surface is a scatterer, as in Choi 2025 and
// in the older raster method (docs/acoustics.md, section 8).

/// Default number of rays per column: the number in the paper's model, and the number of rows in its raster run.
inline constexpr int default_rays = 300, default_raster_rows = 11;

/// Directions of the rays, with one column per beam. The rays of a fan (paper) are uniform in azimuth and elevation, those of a
/// grid (raster) are uniform on an image plane ahead of the sonar, like the pixels of a camera.
struct PaperFan {
  bool perspective = false;
  std::vector<double> azimuth_rad;     // [columns] falling from port to starboard: directions of the beams
  std::vector<double> column_width;    // [columns] width in azimuth [rad]; perspective: in its tangent
  double first_row = 0, row_step = 0;  // elevation [rad] of row 0; perspective: its tangent over the horizontal x axis
  int rows = 0;
  std::vector<Vec3d> ahead;         // [columns]: the part of the direction that depends on the column
  std::vector<double> level, rise;  // [rows]: parts of the direction that depend on the row

  int columns() const { return static_cast<int>(azimuth_rad.size()); }
  /// Unit vector in the sonar's frame.
  Vec3d direction(int column, int row) const;
  double elevation_rad(int column, int row) const {
    return perspective ? std::asin(direction(column, row).z) : first_row + row * row_step;
  }
  /// Solid angle of a ray [sr]. In a fan it is dtheta dphi, without cos(phi), as printed in eq. (2).
  double solid_angle_sr(int column, int row) const;
};

/// `mode` is paper or raster; `rays` is the number of rays per column, 0 = the default. The fan spans twice the quoted vertical
/// width (P900: 40 degrees for 20), like the paper's model.
PaperFan make_paper_fan(const PingPlan& plan, Mode mode, int rays);

/// The hit of a ray on a surface.
struct PaperHit {
  int column = 0, row = 0;
  double range_m = 0;
  double elevation_rad = 0;
  double cosine = 0;  // cosine of the angle between the ray and the normal of the triangle
  double solid_angle_sr = 0;
  std::uint32_t object = 0, triangle = 0;
};

/// Appends the hits of one column, lowest row first.
void trace_column(const RayScene& scene, const PaperFan& fan, const PingScalars& scalars, int column, float far_m,
                  std::vector<PaperHit>& hits);

/// Method for the sum of eq. (1) over the scatterers: with a non-uniform transform (relative error 1e-7), or term by term.
enum class FrequencySum { fast, direct };

/// Eq. (2) without xi: mu cos^2(incidence) r^2 dOmega [m^2], the printed footprint. Lambert's law would have cos^1 here.
inline double printed_cross_section_m2(double mu, double cosine, double range_m, double solid_angle_sr) {
  return mu * cosine * cosine * range_m * range_m * solid_angle_sr;
}

/// A scatterer in the record of one column. The record is one period long: `turns` = delay / record length.
struct PaperEcho {
  double turns = 0;
  spectral::Complex amplitude;  // [uPa], includes e^{-i 2 pi f_c tau}; in expected power, the power [uPa^2]
};
/// The scatterers of one column, as a structure of arrays.
struct PaperEchoes {
  std::vector<double> turns, re, im;

  std::size_t size() const { return turns.size(); }
  PaperEcho operator[](std::size_t i) const { return {turns[i], {re[i], im[i]}}; }
  void push_back(const PaperEcho& e);
};
/// Buffers of sum_frequencies, one for each worker.
struct SumScratch {
  std::vector<spectral::Complex> grid, sums;
};

/// The frequencies of eq. (4), f_m = f_min + m df with df = 1 / T and M = b T, and the spectrum of eq. (3) at these
/// frequencies. S_0 is chosen so that the peak of a single echo on a sample has the echo's amplitude.
struct PaperSpectrum {
  int samples = 0;             // samples in the record T
  int count = 0;               // M
  double sample_offset = 0.5;  // offset of sample 0 from the beginning of the record, which is the near edge of the picture
  double first_frequency = 0;  // f_1 - f_c in units of df
  std::vector<double> weight;  // [M] |S(f_m)| df, sum 1
};
PaperSpectrum make_spectrum(const PingPlan& plan);

/// Computes P_j(f_m) of one column: the sum over echoes, times |S|. `fast` has width 8; null = term by term.
void sum_frequencies(const PaperEchoes& echoes, const PaperSpectrum& spectrum, const spectral::FrequencySums* fast,
                     const simd::Kernels& kernels, SumScratch& scratch, std::span<std::complex<float>> out);

/// The weights "as coded" (P25 does not print them): V_jk = |sin y / y|, y = pi 0.884 / spacing sin(theta_j - theta_k), divided
/// by the root of the sum of all V^2. `squared`: V_jk^2, for expected power. [beams][columns]
std::vector<float> make_correction(std::span<const double> azimuth_rad, double spacing_rad, bool squared);

/// Makes the correction, not squared, for uniform azimuths, for which V depends only on the difference of two azimuths. Returns
/// null if the azimuths are not uniform.
std::unique_ptr<BeamTransformTables> even_correction(std::span<const double> azimuth_rad, double spacing_rad);
/// out[j][...] = sum_k V_jk in[k][...] with these tables; rows have `values` floats, a multiple of 32.
void correct(const BeamTransformTables& even, std::span<const float> in, int values, const simd::Kernels& kernels, Parallel& pool,
             std::span<float> out);

/// The weights of four beams side by side, [(beams + 3) / 4][columns][4]: in the kernels' layout.
std::vector<float> panels_of(std::span<const float> weights, int beams, int columns);
/// out[j] = sum_k weights[j][k] in[k]. Rows have `values` floats; `panels` holds the weights.
void correct(std::span<const float> panels, int beams, int columns, std::span<const float> in, int values,
             const simd::Kernels& kernels, Parallel& pool, std::span<float> out);

/// s[n] = sum_m P(f_m) e^{i 2 pi (f_m - f_c) t_n}: the samples of the record from its spectrum.
class InverseTransform {
 public:
  explicit InverseTransform(const PaperSpectrum& spectrum);
  /// `spectrum`: [M]; `out`: [samples], interleaved complex. Thread-safe if each thread passes its own `work`.
  void run(std::span<const std::complex<float>> spectrum, std::vector<spectral::Complex>& work, float* out) const;

 private:
  const PaperSpectrum& grid_;
  std::unique_ptr<spectral::Fft> inverse_;    // null in a build without a transform
  std::vector<spectral::Complex> half_turn_;  // [M] e^{i 2 pi f_m t_0}
  std::vector<spectral::Complex> root_;       // [samples] e^{i 2 pi n / samples}
  std::vector<spectral::Complex> baseband_;   // [samples] e^{i 2 pi f_1 t_n}
};

/// Table of |p|^2 of a single echo in the record. Expected power is a sum of such pulses.
class PulsePower {
 public:
  PulsePower(const PaperSpectrum& spectrum, const InverseTransform& inverse);
  /// power[n] += echo power * |p(t_n - tau)|^2 for all samples of the record.
  void add(const PaperEcho& echo, std::span<float> power) const;

 private:
  int samples_, steps_;
  double offset_;
  std::vector<float> table_;  // [steps + 1][samples]
};

}  // namespace sonar::paper
