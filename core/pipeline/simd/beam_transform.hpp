// The tables of a beam transform as the kernels read them: plain pointers into BeamTransformTables
// (core/pipeline/plan_tables.hpp), which owns the tables.
#pragma once

#include <cstdint>

namespace sonar::simd {

struct BeamTransform {
  static constexpr int most_levels = 12;
  struct Level {
    int radix, size;     // radix 2, 3, 4 or 6, but 6 not in the last level; size of its blocks
    const float* turns;  // [size / radix][radix - 1] complex: e^{-i 2 pi i m / size}
  };
  int columns = 0, beams = 0;
  int quarter = 0, levels = 0;  // the transform's size is 4 * quarter >= 2 * columns
  Level level[most_levels] = {};
  const float* split = nullptr;     // [quarter][3] complex: factors of the first pass
  const float* response = nullptr;  // [4 * quarter]: divided by the size; frequencies in the order of the passes' output
  int taps = 1;                     // columns from which a beam is interpolated
  const std::int32_t* first_column = nullptr;  // [beams]: first of these columns
  const float* between = nullptr;              // [beams][taps]: their weights
};

}  // namespace sonar::simd
