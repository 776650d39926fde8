// Structs in the device's memory. They are plain; the host fills them and the kernel bodies read them. They use only C++17 and
// fixed-width members. Both sides are compiled from this file, and cuda_machine.cpp checks that they agree.
#pragma once

#include <cstdint>

#include "core/base/geometry.hpp"
#include "core/base/host_device.hpp"
#include "core/base/random.hpp"
#include "core/pipeline/arithmetic/beam_mix.hpp"
#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/kernel_math.hpp"

namespace sonar::cuda {

inline constexpr std::uint32_t no_object = 0xFFFFFFFFu;  // the object of a ray that hits nothing
inline constexpr std::uint32_t slots_a_chunk = 256;      // cells that are sorted into columns together
inline constexpr std::uint32_t counters_a_ping = 2;
inline constexpr std::uint32_t beams_a_panel = 4;  // equals the beams of BeamPanel
inline constexpr std::uint32_t sum_parts =
    8;  // number of threads that share the sum of one column; a pulse has about as many taps
inline constexpr std::uint32_t spread_parts = 32;   // number of threads that share the grid of one column
inline constexpr std::uint32_t panels_at_once = 2;  // number of panels that one thread sums

/// The boxes of both children, in one cache line. BvhLeaf explains the links.
struct alignas(64) BvhNode {
  float low[2][3], high[2][3];
  std::int32_t link[2];
  std::int32_t unused[2];
};
/// A link refers to a node by its index, or to a leaf by its first item and the number of its items, 1 to 8.
struct BvhLeaf {
  std::uint32_t first, count;
};
SONAR_HD constexpr std::int32_t bvh_link(BvhLeaf leaf) { return ~static_cast<std::int32_t>(leaf.first * 8u + (leaf.count - 1u)); }
SONAR_HD constexpr bool is_leaf(std::int32_t link) { return link < 0; }
SONAR_HD constexpr BvhLeaf bvh_leaf(std::int32_t link) {
  const auto bits = static_cast<std::uint32_t>(~link);
  return {bits / 8u, bits % 8u + 1u};
}

/// Corners relative to the scene's origin, or in the axes of a body.
struct alignas(16) FlatTriangle {
  float a[3];
  std::uint32_t object;
  float b[3];
  std::uint32_t triangle;  // in the object's mesh
  float c[3];
  std::uint32_t unused;
};
/// A moving body at its pose in this ping.
struct PlacedBody {
  float turn[9];      // body to world axes, row-major
  float position[3];  // relative to the scene's origin [m]
  std::int32_t root;  // root of its hierarchy
};
struct TracerView {
  const BvhNode* nodes = nullptr;  // hierarchies of fixed objects and of all bodies
  const FlatTriangle* triangles = nullptr;
  const BvhNode* top = nullptr;  // over `bodies`
  const PlacedBody* bodies = nullptr;
  std::int32_t still_root = -1, has_still = 0, body_count = 0, unused = 0;
};

/// One ray of the fan: FanSample and its SurfaceHit (core/pipeline/fan_refinement.hpp).
struct FanRay {
  float elevation_rad, tangent, forward;
  std::uint32_t object;
  float range_m, inverse_x;
  Vec3 normal;
  float offset;
  Vec3 direction;
};
struct ColumnSine {
  float along, across;
};
struct BaseElevation {
  float angle_rad, cosine, sine;
};
/// First hit of a beam or a column; range 0 = none.
struct FirstHit {
  float range_m;
  std::uint32_t object;
};

/// simd::TileSeen and the values of its tile.
struct TileView {
  const std::int16_t* cells;  // eight columns of `count`, in the order of CellTile::Column
  const float* law;           // null = Lambert's cosine
  std::int32_t count, axis;
  float position_unit_m;
  float from_sonar_object[3], from_sonar[3], turn[9];
  float range_m, sample_shift, phase_turns, amplitude, area_amplitude;
  float fade_in_from_m, fade_in_per_m, fade_out_to_m, fade_out_per_m;
  float from_tangent, to_tangent, tolerance_share, turned_away;
  std::int32_t mark, moves, in_side_lobes;
  float seen_turn[9], seen_place[3];
};

struct alignas(16) Echo {
  float sample, re, im;
  std::int32_t column;  // -1 = no echo
};

/// simd::GroupView for all columns at once, and the fan.
struct SeaView {
  std::int32_t conical, columns, elevations, bins, expected_power;
  std::int32_t side_elevations, side_columns;  // PingPlan::side_column
  std::int32_t columns_beside, has_upper_marks;
  float first_edge_sine, columns_per_sine, depth_tolerance_m;
  TangentAxis axis;
  float turns_per_m, decay_per_m, samples_per_m, sample_offset, first_sample, last_sample;
  float elevation[elevation_terms], elevation_aperture;
  // the fan
  float origin[3], world_from_sonar[9], far_m, pulse_width_m, truth_half_width_rad, column_spacing;
};

struct BeamWeightRow {  // beams_a_panel beams, see BeamPanel
  std::int32_t first_column, count;
  std::uint32_t weights, unused;
};
struct VolumeSlice {
  double range_per_x, weight;
  std::int32_t bin, unused;
};
/// The pulse of a point or of another sonar on the sample grid; `values`: complex doubles of samples [from, to).
struct PulseInBeams {
  double sine;
  const double* values;
  std::int32_t from, to;
};

/// Tables of spectral_steps.hpp. If grids is null, pulse_rows is used instead.
struct SpectralView {
  double* grids;             // complex [columns][points]
  double* folded;            // complex [columns][period]
  const double* kernel;      // [terms][padded]
  const double* correction;  // [frequencies]
  const double* response;    // complex [frequencies]
  std::int32_t points, period, frequencies, width, terms, padded;
};

struct NoiseKey {
  RandomKey seed;
  std::uint32_t sonar, ping;
};

/// All values of one ping. Pointers refer to the device's memory; null = the part is absent.
struct PingView {
  TracerView tracer;
  SeaView sea;
  // plan
  const ColumnSine* column_sines;        // [columns]
  const BaseElevation* base_elevations;  // [elevations]
  const float* pulse_rows;               // null if `spectral` is used
  const float* transmit;                 // [columns]
  const float* weights;
  const BeamWeightRow* panels;          // [beams / 4, rounded up]
  const double* beam_sines;             // [beams]
  const ReceivePattern* beam_patterns;  // [beams]
  const double* column_u;               // [columns], in double
  const float* noise_table;             // complex, noise_table_samples of them
  const float* grain_table;             // the same, for leak and volume, with the correlation of the pulse
  std::int32_t taps, pulse_steps, samples, per_row, rows, beams;
  SpectralView spectral;  // grids and folded belong to this ping
  // surfaces
  const TileView* tiles;
  const std::uint32_t* tile_first_slot;  // [tiles + 1]
  std::uint32_t tile_count, slots, chunks, has_scene;
  FanRay* fan_rays;          // [elevations][columns]
  float* depth;              // [columns][bins + 1]
  float* depth_slope;        // [columns][bins + 1], DepthMap::per_column
  FirstHit* first_hits;      // [elevations - 1][columns], null = not needed
  FirstHit* column_truth;    // [columns], a result
  Echo* echoes;              // [slots]
  std::uint32_t* rank;       // [slots]: number of earlier echoes of the chunk in the same column
  std::uint32_t* in_chunk;   // [chunks][columns]: number of echoes; later, that of all earlier chunks
  std::uint32_t* in_column;  // [columns]
  std::uint32_t* column_at;  // [columns]: first of the column's echoes in `sorted`
  Echo* sorted;              // [slots]
  // columns
  float* signals;          // complex [columns][samples]
  const float* multipath;  // complex [columns][multipath_stride]
  std::int64_t multipath_stride;
  const VolumeSlice* slices;
  const double* open_power;    // [samples]
  const double* column_width;  // [columns]
  double* blocked;             // [samples][columns]
  double open_fan, volume_samples_per_m, volume_sample_offset;
  const float* leak_rms;  // [leak_samples]
  std::int32_t slice_count, leak_samples, has_noise, unused;
  const float *noise_far, *noise_near_less_far, *noise_decay;  // NoiseProfile, null = uniform
  std::int64_t noise_decays;                                   // samples
  float noise_rms, leak_steady, leak_changing, crosstalk_own, crosstalk_leaked;
  NoiseKey noise_key;
  // beams
  float* beam_signals;                      // complex [beams][samples]
  const PulseInBeams* points;               // [point_count]
  const PulseInBeams* pulses;               // [pulse_count], of other sonars
  double* point_weights;                    // [point_count + pulse_count][beams]
  float* crosstalk;                         // complex [samples], null = none
  float* mixed;                             // complex [beams][samples], null = beams are not mixed
  const float* shared_noise;                // [shared_parts][beams][2][shared_samples], SharedNoiseTable; null = none
  const float *shared_rms, *shared_steady;  // [shared_samples] in a channel
  const float* shared_leak;                 // [shared_leak_samples] amplitude in a channel
  std::int64_t shared_samples, shared_leak_samples;
  std::uint32_t shared_parts;
  BeamMixView mix;
  std::int32_t point_count, pulse_count;
  // samples
  const float* row_power_factor;                // [rows]
  const float* beam_power_factor;               // [beams], null = all equal
  float half_gamma, per_octave, at_full_scale;  // the last two are LevelLine's
  float code_factor, code_rounding;             // simd::CodeScale
  std::uint32_t max_code;
  std::int32_t bytes_a_sample, logarithmic;
  std::uint8_t* codes;      // [rows][beams][bytes]
  float* pressure;          // [rows][beams], null = not needed
  float* kept_beams;        // complex [samples][beams], null = not needed
  std::uint32_t* counters;  // [counters_a_ping]: number of rays, number of echoes
};

/// The kernels of a ping, in the order of their launches; steps.hpp has their bodies.
enum class Step : std::int32_t {
  clear,
  trace_base,
  refine,
  first_hits,
  scatter,
  rank,
  scan_chunks,
  scan_columns,
  place,
  sum_columns,
  spread,
  fold,
  unfold,
  multipath,
  volume,
  finish_columns,
  point_weights,
  form_beams,
  refocus,
  blend,
  crosstalk_sum,
  crosstalk_add,
  receive,
  steps
};
inline constexpr std::int32_t step_count = static_cast<std::int32_t>(Step::steps);

/// Steps [from, to) for pings whose views lie in the device's memory.
struct Launch {
  const PingView* views = nullptr;
  std::int32_t pings = 0, from = 0, to = step_count, timed = 0;
  std::uint32_t largest[step_count] = {};  // largest step_size of the pings
};
struct StepSeconds {
  double of[step_count] = {};
  double transforms = 0;
};

}  // namespace sonar::cuda
