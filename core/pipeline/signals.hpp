// Values that the stages of a ping pass to later stages: columns, depth map, echoes, signals by column and by beam.
#pragma once

#include <complex>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/aligned.hpp"
#include "core/pipeline/simd/kernels.hpp"

namespace sonar {

/// Columns of constant direction sine u = y / r, which are cones about the array axis (flat beams: sine of azimuth). The sines
/// fall from port to starboard, like those of the beams.
struct Columns {
  int count = 0;
  double first_sine = 0;        // centre of column 0
  double spacing = 0;           // in u
  std::vector<float> transmit;  // amplitude of the transmitter per column: 1 in the sector, falling to 0 beyond
  double sine(int column) const { return first_sine - column * spacing; }
};

/// Hits of the rays, column by column: 1 / x against the tangent z / x; x is the forward coordinate in the sonar's frame. For
/// flat beams (conical off) x is the horizontal distance.
struct DepthMap {
  int first_column = 0, columns = 0, bins = 0;
  bool has_upper_marks = false;
  std::vector<float> inverse_x;   // [columns][bins + 1], 0 = nothing was hit; its last bits are the surface_mark
  std::vector<float> per_column;  // [columns][bins + 1]: change of inverse_x from column to column along the hit facet

  /// Sets the size for columns [first, last).
  void shape(int first, int last, int bin_count) {
    first_column = first, columns = last - first, bins = bin_count;
    inverse_x.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(bins + 1));
    per_column.resize(inverse_x.size());
  }
  std::ptrdiff_t at(int k) const { return static_cast<std::ptrdiff_t>(k - first_column) * (bins + 1); }
  float* column(int k) { return inverse_x.data() + at(k); }
};

/// One hit of the fixed fan (paper-style sampling: a ray is a scatterer).
struct FanHit {
  int column = 0, ray = 0;
  float range_m = 0, elevation_rad = 0, cosine = 0;
  std::uint32_t object = 0, triangle = 0;
};

/// Echoes to be summed. In expected power, re holds the power and im is 0.
struct Echoes {
  explicit Echoes(int capacity = 0) { reserve(capacity); }
  void reserve(int capacity);
  int capacity() const { return static_cast<int>(column.size()) - 16; }  // kernels may write up to one vector past the end
  simd::EchoArrays at(int index) {
    return {sample.data() + index, re.data() + index, im.data() + index, column.data() + index,
            keeps_power ? power.data() + index : nullptr};
  }
  void add(float at_sample, std::complex<float> amplitude, int in_column);

  int count = 0;
  std::vector<float> sample, re, im;
  std::vector<std::int32_t> column;

  // For labels, if keeps_power is set: the expected power of each echo, and the end of each tile's echoes.
  struct Run {
    std::uint32_t tile;
    int end;  // index after the last echo of the tile
  };
  bool keeps_power = false;
  std::vector<float> power;
  std::vector<Run> runs;
};

/// An echo without a surface. Beams receive it from its exact direction, not from the direction of a column.
struct PointEcho {
  double sine = 0;  // y / r
  double sample = 0;
  std::complex<double> amplitude;  // [uPa]
  std::uint32_t instance = 0;      // instance of its object in labels (core/pipeline/labels.hpp); 0 = none
};

/// A pulse on the sample grid: complex values of samples from first_sample on.
struct SampledPulse {
  int first_sample = 0;
  std::vector<std::complex<double>> values;
};

/// Complex signals per column at the sample centres, interleaved; in expected power, re is a power.
struct ColumnSignals {
  int columns = 0, samples = 0;
  int lead = 0;               // number of samples before sample 0; pulses may begin there
  std::ptrdiff_t stride = 0;  // floats from column to column
  AlignedFloats data;         // every column is aligned to a cache line

  void shape(int column_count, int sample_count, int taps);
  float* column(int k) { return data.data() + k * stride; }
  const float* first_sample(int k) const { return data.data() + k * stride + 2 * lead; }
};

/// Complex beam signals of samples [first_sample, first_sample + samples), interleaved; in expected power, re is a power.
struct BeamSignals {
  int beams = 0, first_sample = 0, samples = 0;
  std::ptrdiff_t stride = 0;  // floats from beam to beam
  std::vector<float> data;

  /// Sets the size for samples [first, first + count). Rows consist of whole vectors.
  void shape(int beam_count, int first, int count);
  const float* beam(int j) const { return data.data() + j * stride; }
  float* beam(int j) { return data.data() + j * stride; }
};

}  // namespace sonar
