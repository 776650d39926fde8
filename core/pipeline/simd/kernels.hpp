// The hot loops of a ping, compiled from kernels.inl for each instruction set and selected at run time. They read and write
// plain arrays. The formulas are explained in their callers (scatter, synthesize, form_beams, receive).
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/random.hpp"
#include "core/pipeline/arithmetic/kernel_math.hpp"
#include "core/pipeline/simd/simd_level.hpp"
#include "core/scene/cells/surface_cells.hpp"

namespace sonar::simd {

// The tables of a beam transform as the kernels read them: plain pointers into BeamTransformTables
// (core/pipeline/plan_tables.hpp), which owns the tables.

struct BeamTransform {
  static constexpr int most_levels = 12;
  struct Level {
    int radix, size;     // radix: 2, 3, 4 or, except in the last level, 6; size: size of a block
    const float* turns;  // [size / radix][radix - 1] complex: e^{-j 2 pi i m / size}
  };
  int columns = 0, beams = 0;
  int quarter = 0, levels = 0;  // the transform's size is 4 * quarter >= 2 * columns
  Level level[most_levels] = {};
  const float* split = nullptr;     // [quarter][3] complex: factors of the first pass
  const float* response = nullptr;  // [4 * quarter]: divided by the size; frequencies in the order of the passes' output
  int taps = 1;                     // columns from which a beam is interpolated
  const std::int32_t* first_column = nullptr;  // [beams]: first of these columns
  const float* between = nullptr;              // [beams][taps]: weights of these columns
};

/// One tile in one ping.
struct TileSeen {
  const CellTile* tile = nullptr;
  float from_sonar_object[3];  // tile centre minus sonar, object axes [m]
  float from_sonar[3];         // the same, sonar axes [m]
  float turn[9];               // object to sonar axes, row-major
  float range_m;               // range of the tile's centre
  float sample_shift;          // delay of its echoes by the Doppler effect [samples]
  float phase_turns;           // carrier phase of the tile centre, in [0, 1)
  float amplitude;             // product of weight_unit and all factors that are constant over the tile
  const float* law;            // root of the scattering strength over sqrt(1 - cosine), law_steps + 2 values; null = cosine
  float area_amplitude;        // like `amplitude`, with the cell size instead of the speckle (expected power)
  float fade_in_from_m, fade_in_per_m, fade_out_to_m, fade_out_per_m;
  // Cells scatter if |tangent| is in this interval: the fan's main part, or the side lobes, where cells are coarser.
  float from_tangent, to_tangent;
  bool in_side_lobes;
  float tolerance_share;  // fraction of the range, in addition to GroupView::depth_tolerance_m
  float turned_away;      // cells with normal * direction * turned_away > 0 scatter nothing; 0: all cells scatter
  std::int32_t mark;      // surface_mark of its object
  bool moves;             // the sonar moves during the ping: the depth map is read at positions in the axes of the rays
  float seen_turn[9], seen_place[3];  // position in these axes = seen_turn * position + seen_place; row-major
};

/// Linear codes (eq. 37): floor(factor v^gamma + rounding), at most max_code.
struct CodeScale {
  float half_gamma, factor, rounding, max_code;
};

/// Values that are the same for all tiles of one column group.
struct GroupView {
  bool conical;  // cones about the array: u = y / r, t = z / x; else flat beams: u = y / h, t = z / h, h^2 = x^2 + y^2
  float first_edge_sine, columns_per_sine;  // column = (first_edge_sine - u) * columns_per_sine
  int first_column, last_column;            // half-open
  TangentAxis axis;                         // axis t of the depth map
  int bins;                                 // bins per column of the depth map, which has bins + 1 values
  int map_first_column, fan_columns;        // first column of the depth map; number of columns of the fan
  int columns_beside;          // if the sonar moves: number of columns on either side in which a cell is also looked up
  const float* inverse_depth;  // DepthMap::inverse_x
  const float* depth_slope;    // DepthMap::per_column
  bool has_upper_marks;        // depth_slope holds the upper bits of object numbers (surface_mark)
  float depth_tolerance_m;
  float turns_per_m;                                              // 2 f / c
  float decay_per_m;                                              // 2 alpha [Np/m]
  float samples_per_m, sample_offset, first_sample, last_sample;  // range window: s = r * samples_per_m - sample_offset
  float elevation[elevation_terms];                               // two-way pattern, polynomial in w
  float elevation_aperture;                                       // [wavelengths]
  bool expected_power;
};

/// Echoes to be summed, as a structure of arrays. The caller owns the memory.
struct EchoArrays {
  float* sample;  // fractional sample index
  float* re;
  float* im;
  std::int32_t* column;    // absolute column
  float* power = nullptr;  // expected value of |re + i im|^2, for labels; null: not needed, or re has it
};

/// Rays that are scatterers. Each ray has its own complex Gaussian, which depends on its counters (core/base/random.hpp).
struct HitDraw {
  const std::uint32_t* counter[3];
  RandomKey key;
};
struct HitsToScatter {
  static constexpr int most = 256;  // largest number of hits per call
  HitDraw draw;
  const float* range_m;
  const float* weight;  // amplitude except for the absorption of the water
  float decay_per_m;    // 2 alpha [Np/m]
  double turns_per_m;   // 2 f / c
};

/// The grid of a non-uniform transform (core/pipeline/pulses/spectral.hpp): `points` complex values, and memory for one more
/// kernel.
struct SpreadGrid {
  static constexpr int width = 8;
  int points = 0, terms = 0;
  const double* polynomial = nullptr;  // [terms][width], highest first
};
/// Echoes that are spread over the grid. Each is first multiplied by e^{-i 2 pi turn_on turns}.
struct SpreadEchoes {
  const double *turns, *re, *im;
  double turn_on;
};

/// A real pulse on the sample grid: row `f` holds `taps` values and then `taps` differences to the next row.
struct PulseRows {
  const float* rows;
  int taps, steps;
};

/// Complex taps of a beam's neighbours, and the number of neighbours. The taps are the same on either side.
struct FocusTaps {
  const float* taps;
  int below, above;
};

struct Kernels {
  const char* name;
  /// Appends the visible cells of a tile, and returns their number. `out` must have room for tile.count + 16 more.
  int (*scatter_tile)(const TileSeen&, const GroupView&, EchoArrays out);
  /// re + i im = weight * draw * exp(-decay_per_m range - i 2 pi turns_per_m range), for n <= HitsToScatter::most hits.
  void (*scatter_hits)(const HitsToScatter&, int n, float* re, float* im);
  /// Adds the kernels of the echoes to grid[2 (points + width)].
  void (*spread)(const SpreadGrid&, const SpreadEchoes&, int count, double* grid);
  /// columns[(column - first_column) * stride + 2 * (sample + lead)] += pulse * (re, im). Reads and
  /// writes all aligned vectors that overlap a pulse: two of 8 samples or three of 4, at most 16 samples from the multiple of 8
  /// at or before its first sample. Reads up to one vector of echoes past `count` and ignores their values.
  void (*accumulate)(const EchoArrays&, int count, const PulseRows&, float* columns, std::ptrdiff_t stride, int first_column,
                     int lead);
  /// out[4][floats] = sum over k of panel[k][4] * in[k][floats]; floats is a multiple of 32.
  void (*form_beam_panel)(const float* in, std::ptrdiff_t in_stride, const float* panel, int count, float* out, int floats);
  /// Makes beams from `floats` (a multiple of 32) interleaved values of each column, by a transform across the columns. `work`:
  /// BeamTransformTables::work_floats(), 64-byte aligned.
  void (*transform_beams)(const BeamTransform&, const float* columns, std::ptrdiff_t stride, int floats, float* work, float* out,
                          std::ptrdiff_t out_stride);
  /// to[floats] = tap 0 times the complex samples at `from`, plus tap d times the sum of the samples d rows before and d rows
  /// after it. Rows are `stride` floats apart. Reads up to one vector past the end of a row.
  void (*refocus)(const float* from, std::ptrdiff_t stride, const FocusTaps&, int floats, float* to);
  /// power[row * width + beam] = |beams[beam * stride + 2 * row ...]|^2.
  void (*detect)(const float* beams, std::ptrdiff_t stride, int beam_count, int rows, float* power, int width);
  /// codes[i] is the code, as float, of v^2 = power[i] * gain; n is a multiple of 16.
  void (*quantise)(const float* power, float gain, const CodeScale&, float* codes, int n);
  /// The same codes as bytes; max_code is at most 255.
  void (*quantise_bytes)(const float* power, float gain, const CodeScale&, std::uint8_t* codes, int n);
  /// Logarithmic codes, as float: per_octave log2(power[i] * gain) + at_full_scale, rounded, from 0 to max_code (LevelLine).
  void (*quantise_levels)(const float* power, float gain, float per_octave, float at_full_scale, float max_code, float* codes,
                          int n);
};

/// The kernels of a level. `automatic` means the level in the environment variable SONARD_SIMD, else the best level of this
/// processor. If the processor lacks the level, the next lower one is used (on ARM, NEON instead of AVX). Throws
/// std::runtime_error if SONARD_SIMD is not the name of a level.
const Kernels& kernels_for(SimdLevel level);

extern const Kernels portable_kernels, avx2_kernels, avx512_kernels, neon_kernels;

}  // namespace sonar::simd
