// The tables of a beam transform as the kernels read them: plain pointers into BeamTransformTables, which makes and owns them
// (core/pipeline/plan_tables.hpp).
#pragma once

#include <cstdint>

namespace sonar::simd {

struct BeamTransform {
  static constexpr int most_levels = 12;
  struct Level {
    int radix, size;     // 2, 3, 4 or 6, of the last one not 6; of the blocks it works on
    const float* turns;  // [size / radix][radix - 1] complex: e^{-i 2 pi i m / size}
  };
  int columns = 0, beams = 0;
  int quarter = 0, levels = 0;  // the transform's size is 4 * quarter >= 2 * columns
  Level level[most_levels] = {};
  const float* split = nullptr;     // [quarter][3] complex: turns of the first pass
  const float* response = nullptr;  // [4 * quarter], in the order the passes leave frequencies in, over the size
  int taps = 1;
  const std::int32_t* first_column = nullptr;  // [beams]
  const float* between = nullptr;              // [beams][taps]
};

}  // namespace sonar::simd
