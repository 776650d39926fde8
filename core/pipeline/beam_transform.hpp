// Beams of all columns at once: where the columns are even in the sine, the sum over columns (form_beams.hpp) is a convolution,
// exact by a Fourier transform across a line twice as long; beams between columns are read off by a few weights, since an array's
// response varies no faster than its aperture allows. Used by form_beams() in place of wide bands of weights.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/signals.hpp"
#include "core/pipeline/simd/beam_transform.hpp"

namespace sonar {

class BeamTransformTables {
 public:
  /// Relative error of the reading between columns at most 2e-6 for columns up to 0.35 of a beam apart (single precision: 1e-6).
  BeamTransformTables(const ReceivePattern& pattern, const Columns& columns, const std::vector<double>& beam_sines);
  /// As many beams as columns, each on its column, which counts columns d away with the weight of_distance[d].
  explicit BeamTransformTables(const std::vector<double>& of_distance);
  BeamTransformTables(const BeamTransformTables&) = delete;
  BeamTransformTables& operator=(const BeamTransformTables&) = delete;

  const simd::BeamTransform& tables() const { return tables_; }
  /// Floats of scratch for the kernel, 64-byte aligned.
  std::size_t work_floats() const { return static_cast<std::size_t>(4 * tables_.quarter) * 32; }

  std::size_t bytes() const;
  /// Vector operations a group of sixteen samples takes, to compare with a band's.
  double cost() const;

 private:
  void lay_out(int columns, int beams);
  void plan_passes();
  void weigh(const std::vector<double>& of_distance);
  void point_at_tables();
  void read_between(double aperture_in_spacings, const Columns& columns, const std::vector<double>& beam_sines);

  simd::BeamTransform tables_;
  std::vector<float> split_, response_, between_;
  std::vector<std::vector<float>> turns_;
  std::vector<std::int32_t> first_column_;
};

}  // namespace sonar
