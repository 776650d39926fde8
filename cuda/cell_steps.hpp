// Kernel bodies between the depth map and the columns' signals. Each cell in view gives one echo or none. The echoes are sorted
// into columns in the order of tiles and cells. Each column adds its echoes in this order. So the additions have the same order
// as on the CPU, and need no atomic operations on floats.
#pragma once

#include <cmath>

#include "core/pipeline/arithmetic/kernel_math.hpp"
#include "cuda/counting.hpp"
#include "cuda/device_types.hpp"

namespace sonar::cuda {

enum CellColumn { cell_x, cell_y, cell_z, cell_normal_x, cell_normal_y, cell_normal_z, cell_weight_re, cell_weight_im };
inline constexpr float cell_normal_unit = 1.0f / 32767.0f;  // equals CellTile::normal_unit

SONAR_HD inline float cell_value(const TileView& t, int column, int cell) {
  return static_cast<float>(t.cells[static_cast<std::int64_t>(column) * t.count + cell]);
}

/// The position of a cell. place_cell() computes it, or returns false if the cell is not visible.
struct CellPlace {
  float range, offset, cosine, sine2, sample;
  std::int32_t column;
};
SONAR_HD inline bool place_cell(const PingView& p, const TileView& t, int cell, CellPlace& at) {
  const SeaView& g = p.sea;
  const float dx = t.position_unit_m * cell_value(t, cell_x, cell), dy = t.position_unit_m * cell_value(t, cell_y, cell),
              dz = t.position_unit_m * cell_value(t, cell_z, cell);
  const float qx = t.from_sonar_object[0], qy = t.from_sonar_object[1], qz = t.from_sonar_object[2];
  // As in see_cells (core/pipeline/simd/cells.inl): r^2 = r0^2 + e, which avoids a difference of large numbers.
  const float e = dx * (2 * qx + dx) + dy * (2 * qy + dy) + dz * (2 * qz + dz);
  const float r = std::sqrt(larger(t.range_m * t.range_m + e, 1e-6f));
  const float inverse_r = 1.0f / r;
  const float x = t.from_sonar[0] + t.turn[0] * dx + t.turn[1] * dy + t.turn[2] * dz;
  const float y = t.from_sonar[1] + t.turn[3] * dx + t.turn[4] * dy + t.turn[5] * dz;
  const float z = t.from_sonar[2] + t.turn[6] * dx + t.turn[7] * dy + t.turn[8] * dz;
  const float h = g.conical != 0 ? x : std::sqrt(x * x + y * y);
  const float inverse_h = 1.0f / larger(h, 1e-6f);
  const float column = (g.first_edge_sine - y * (g.conical != 0 ? inverse_r : inverse_h)) * g.columns_per_sine;
  // Direction of the cell from the origin of the rays. The sonar may have turned since the rays were traced.
  float seen_column = column, seen_z = z, seen_inverse_h = inverse_h;
  if (t.moves != 0) {
    const float *w = t.seen_turn, *o = t.seen_place;
    const float there_x = o[0] + w[0] * x + w[1] * y + w[2] * z, there_y = o[1] + w[3] * x + w[4] * y + w[5] * z;
    seen_z = o[2] + w[6] * x + w[7] * y + w[8] * z;
    const float flat = std::sqrt(there_x * there_x + there_y * there_y);
    seen_inverse_h = 1.0f / larger(g.conical != 0 ? there_x : flat, 1e-6f);
    const float over_range = g.conical != 0 ? 1.0f / larger(std::sqrt(flat * flat + seen_z * seen_z), 1e-6f) : seen_inverse_h;
    const float wanted = (g.first_edge_sine - there_y * over_range) * g.columns_per_sine;
    const float own = static_cast<float>(static_cast<std::int32_t>(larger(column, 0.0f))),
                beside = static_cast<float>(g.columns_beside);
    seen_column = smaller(larger(wanted, larger(own - beside, 0.0f)), smaller(own + beside, static_cast<float>(g.columns - 1)));
  }
  const float tangent = seen_z * seen_inverse_h, steepness = std::fabs(tangent);
  const float sample = r * g.samples_per_m - g.sample_offset + t.sample_shift;
  if (!(column >= 0 && column < static_cast<float>(g.columns) && steepness >= t.from_tangent && steepness < t.to_tangent &&
        x > 1e-6f && sample > g.first_sample && sample < g.last_sample && r >= t.fade_in_from_m && r < t.fade_out_to_m))
    return false;
  at.column = static_cast<std::int32_t>(column);
  // Compares with the depth map between two bins, with the tolerances of docs/acoustics.md, section 3.
  const float bin = smaller(bin_of_tangent(g.axis, tangent), static_cast<float>(g.bins) - bin_rounding);
  const auto below = static_cast<std::int32_t>(bin);
  const auto map_column = static_cast<std::int32_t>(seen_column);
  const std::int64_t map_at = static_cast<std::int64_t>(map_column) * (g.bins + 1) + below;
  const float* map = p.depth + map_at;
  const float seen = map[0] + (bin - static_cast<float>(below)) * (map[1] - map[0]);
  const float tolerance = seen_inverse_h * (g.depth_tolerance_m * inverse_r + t.tolerance_share);
  if (!(seen_inverse_h + tolerance >= seen)) return false;
  const float along = cell_value(t, cell_normal_x, cell) * (qx + dx) + cell_value(t, cell_normal_y, cell) * (qy + dy) +
                      cell_value(t, cell_normal_z, cell) * (qz + dz);
  if (!(along * t.turned_away <= 0)) return false;
  // Compares with the plane of another object's facet, extended from the ray's position in the column to that of the cell.
  const float* slope = p.depth_slope + map_at;
  const auto differs = [&](std::int32_t i) {
    const auto in_map = static_cast<std::int32_t>(bits_of(map[i])), in_slope = static_cast<std::int32_t>(bits_of(slope[i]));
    return ((in_map ^ t.mark) & surface_marks) != 0 ||
           (g.has_upper_marks != 0 && ((in_slope ^ upper_mark(t.mark)) & upper_marks) != 0);
  };
  if (seen_inverse_h - tolerance < seen && differs(0) && differs(1)) {
    const float nearness = seen_inverse_h * (1.0f + contact_share + contact_m * inverse_r);
    const float beside = seen_column - static_cast<float>(map_column) - 0.5f;
    if (nearness < seen + beside * slope[0]) return false;
  }
  at.range = r;
  at.offset = e / (t.range_m + r);
  at.cosine = std::fabs(along) * (cell_normal_unit * inverse_r);
  at.sine2 = z * z / (h * h + z * z);
  at.sample = sample;
  return true;
}

SONAR_HD inline Echo scatter_cell(const PingView& p, const TileView& t, int cell) {
  Echo echo{0, 0, 0, -1};
  CellPlace at{};
  if (!place_cell(p, t, cell, at)) return echo;
  const SeaView& g = p.sea;
  // Eq. 6 of docs/acoustics.md, as in scatter_cells.
  const float law = t.law != nullptr ? law_root(t.law, at.cosine) : at.cosine;
  const float re = cell_value(t, cell_weight_re, cell), im = cell_value(t, cell_weight_im, cell);
  const float x = g.elevation_aperture * std::sqrt(at.sine2);
  const float pattern =
      t.in_side_lobes != 0 ? side_lobe_pattern(x, sine_of_turns(0.5f * x)) : elevation_pattern(g.elevation, at.sine2);
  echo.sample = at.sample;
  echo.column = at.column;
  if (g.expected_power != 0) {
    const float slope = std::fabs(cell_value(t, cell_normal_x + t.axis, cell)) * cell_normal_unit;
    const float per_area = re != 0 || im != 0 ? 1.0f / slope : 0.0f;  // padding has no echo
    const float amplitude = t.area_amplitude * law * pattern * std::exp(-g.decay_per_m * at.offset) / (at.range * at.range);
    echo.re = amplitude * amplitude * level_weight(t, at.range) * per_area;
    return echo;
  }
  const float d = -g.decay_per_m * at.offset;
  const float amplitude =
      t.amplitude * std::sqrt(level_weight(t, at.range)) * law * pattern * exp_near_0(d) / (at.range * at.range);
  const float turns = -(t.phase_turns + g.turns_per_m * at.offset);
  const float cs = amplitude * sine_of_turns(turns + 0.25f), sn = amplitude * sine_of_turns(turns);
  echo.re = re * cs - im * sn;
  echo.im = re * sn + im * cs;
  return echo;
}

/// Finds the tile of slot `i`.
SONAR_HD inline std::uint32_t tile_of(const PingView& p, std::uint32_t i) {
  std::uint32_t low = 0, high = p.tile_count;
  while (high - low > 1) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (p.tile_first_slot[middle] <= i)
      low = middle;
    else
      high = middle;
  }
  return low;
}

SONAR_HD inline void scatter(const PingView& p, std::uint32_t i) {
  const std::uint32_t tile = tile_of(p, i);
  p.echoes[i] = scatter_cell(p, p.tiles[tile], static_cast<int>(i - p.tile_first_slot[tile]));
}

/// Counts the echoes in the chunk and column of slot `i`: those before slot `i` (rank), and all of them (in_chunk).
SONAR_HD inline void rank(const PingView& p, std::uint32_t i) {
  const std::int32_t column = p.echoes[i].column;
  if (column < 0) return;
  const std::uint32_t chunk = i / slots_a_chunk;
  std::uint32_t before = 0;
  for (std::uint32_t j = chunk * slots_a_chunk; j < i; ++j) before += p.echoes[j].column == column ? 1u : 0u;
  p.rank[i] = before;
  add_count(p.in_chunk[chunk * static_cast<std::uint32_t>(p.sea.columns) + static_cast<std::uint32_t>(column)], 1u);
}

/// Replaces, in column `k`, the count of each chunk with the sum of the counts of earlier chunks.
SONAR_HD inline void scan_chunks(const PingView& p, std::uint32_t k) {
  const auto columns = static_cast<std::uint32_t>(p.sea.columns);
  constexpr std::uint32_t at_once =
      8;  // number of values that are read before any is written, so that the device waits only once for memory
  std::uint32_t before = 0;
  for (std::uint32_t from = 0; from < p.chunks; from += at_once) {
    const std::uint32_t some = p.chunks - from < at_once ? p.chunks - from : at_once;
    std::uint32_t count[at_once];
    for (std::uint32_t c = 0; c < at_once; ++c) count[c] = c < some ? p.in_chunk[(from + c) * columns + k] : 0;
    for (std::uint32_t c = 0; c < at_once; ++c) {
      if (c < some) p.in_chunk[(from + c) * columns + k] = before;
      before += count[c];
    }
  }
  p.in_column[k] = before;
}
SONAR_HD inline void scan_columns(const PingView& p, std::uint32_t k) {
  std::uint32_t before = 0;
  for (std::uint32_t column = 0; column < k; ++column) before += p.in_column[column];
  p.column_at[k] = before;
  if (k + 1 == static_cast<std::uint32_t>(p.sea.columns)) p.counters[1] = before + p.in_column[k];
}
SONAR_HD inline void place(const PingView& p, std::uint32_t i) {
  const Echo echo = p.echoes[i];
  if (echo.column < 0) return;
  const auto column = static_cast<std::uint32_t>(echo.column);
  const std::uint32_t chunk = i / slots_a_chunk;
  p.sorted[p.column_at[column] + p.in_chunk[chunk * static_cast<std::uint32_t>(p.sea.columns) + column] + p.rank[i]] = echo;
}

/// Adds the pulses of a column's echoes at the samples n = part modulo sum_parts, where i = column * sum_parts + part.
SONAR_HD inline void sum_columns(const PingView& p, std::uint32_t i) {
  const std::uint32_t k = i / sum_parts;
  const int part = static_cast<int>(i % sum_parts);
  constexpr int parts = static_cast<int>(sum_parts);
  // These values are copied, because the compiler must assume that the sums below can change the view.
  const int samples = p.samples, taps = p.taps;
  const float* const pulse_rows = p.pulse_rows;
  float* const signal = p.signals + 2 * static_cast<std::int64_t>(k) * samples;
  for (int n = part; n < samples; n += parts) signal[2 * n] = signal[2 * n + 1] = 0;
  if (p.slots == 0) return;
  // Eq. 8: selects the row of the pulse table from the position of the echo between two samples.
  const int reach = taps / 2 - 1;
  const float steps = static_cast<float>(p.pulse_steps);
  const Echo* echo = p.sorted + p.column_at[k];
  const Echo* const end = echo + p.in_column[k];
  for (; echo != end; ++echo) {
    const float sample = echo->sample, echo_re = echo->re, echo_im = echo->im;
    const float whole = std::floor(sample);
    const int first = static_cast<int>(whole) - reach;
    const float position = (sample - whole) * steps;
    const int step = static_cast<int>(position);
    const float fraction = position - static_cast<float>(step);
    const float* const row = pulse_rows + static_cast<std::int64_t>(step) * 2 * taps;
    for (int tap = (part - first) & (parts - 1); tap < taps; tap += parts) {
      const int n = first + tap;
      if (n < 0 || n >= samples) continue;
      const float pulse = row[tap] + fraction * row[taps + tap];
      signal[2 * n] += pulse * echo_re;
      signal[2 * n + 1] += pulse * echo_im;
    }
  }
}

}  // namespace sonar::cuda
