// Converts the cells of a tile to echoes: positions, visibility by the depth map, amplitudes. The file is included once per
// instruction set, after kernels.inl. Every value is a vector over cells. Hidden cells are dropped before amplitudes are
// computed.

inline constexpr int chunk = 256;

struct Chunk {  // the visible cells of one part of a tile, packed
  alignas(64) float range[chunk + 16], offset[chunk + 16], cosine[chunk + 16], sine2[chunk + 16], column[chunk + 16],
      weight_re[chunk + 16], weight_im[chunk + 16], area[chunk + 16];
};

/// Limits of the range of a tile's cells, from its level and from the record.
struct RangeWindow {
  float from_m, to_m;
};
inline RangeWindow range_window(const TileSeen& s, const GroupView& g) {
  const float shift = g.sample_offset - s.sample_shift;
  return {larger(s.fade_in_from_m, (g.first_sample + shift) / g.samples_per_m),
          smaller(s.fade_out_to_m, (g.last_sample + shift) / g.samples_per_m)};
}

/// Area of cells in lattice squares: 1 / |normal along the dominant axis|, which is larger on a slope; 0 for padding.
inline Lanes area_of(const CellTile& t, int i, Lanes weight_re, Lanes weight_im) {
  const Lanes along = counts(t.column(static_cast<CellTile::Column>(CellTile::normal_x + t.axis)) + i);
  const Lanes weight2 = weight_re * weight_re + weight_im * weight_im;
  return choose(below(all(0), weight2), 1.0f / (magnitude(along) * CellTile::normal_unit), all(0));
}

/// The values of visible cells that are kept: weights, areas, or both.
struct Wanted {
  bool weights, areas;
};
inline __attribute__((always_inline)) void pack_weights(const CellTile& t, int i, LaneMask keep, Wanted wanted, int m, Chunk& c) {
  const Lanes re = counts(t.column(CellTile::weight_re) + i), im = counts(t.column(CellTile::weight_im) + i);
  if (wanted.areas) pack(c.area + m, keep, area_of(t, i, re, im));
  if (!wanted.weights) return;
  pack(c.weight_re + m, keep, re);
  pack(c.weight_im + m, keep, im);
}

/// True for cells behind the plane of the hit facet. It is computed for cells of another object than the one
/// hit in their direction. `at`: index into the map; `nearness`: 1 / x of the cells with the tolerance for contact.
inline __attribute__((noinline)) LaneMask hidden(const GroupView& g, LaneNumbers at, Lanes seen, Lanes column, Lanes nearness) {
  const Lanes beside = column - as_floats(whole_part(column)) - 0.5f;
  return below(nearness, seen + beside * gather(g.depth_slope, at));
}

/// True if both values of the map beside a cell, with the marks a and b, belong to other objects than the tile.
inline LaneMask foreign_marks(std::int32_t mark, Lanes a, Lanes b) {
  return both(bits_differ(a, mark, surface_marks), bits_differ(b, mark, surface_marks));
}
/// Like foreign_marks(), for object numbers that do not fit into the marks of 1 / x.
inline __attribute__((noinline)) LaneMask foreign_numbers(const GroupView& g, std::int32_t mark, LaneNumbers at, Lanes a,
                                                          Lanes b) {
  Lanes upper_a, upper_b;
  gather_pairs(g.depth_slope, at, upper_a, upper_b);
  return both(either(bits_differ(a, mark, surface_marks), bits_differ(upper_a, upper_mark(mark), upper_marks)),
              either(bits_differ(b, mark, surface_marks), bits_differ(upper_b, upper_mark(mark), upper_marks)));
}

/// Computes range, column, elevation and cosine of incidence of cells. Keeps the cells that lie in the group's window, do not
/// face away, and are not behind the depth map in their direction. Returns their number.
template <bool conical, bool moves>
__attribute__((noinline)) int see_cells(const TileSeen& s, const GroupView& g, Wanted what, int from, int n, Chunk& c) {
  const CellTile& t = *s.tile;
  const std::int16_t *tx = t.column(CellTile::x), *ty = t.column(CellTile::y), *tz = t.column(CellTile::z);
  const std::int16_t *nx = t.column(CellTile::normal_x), *ny = t.column(CellTile::normal_y), *nz = t.column(CellTile::normal_z);
  const float unit = t.position_unit_m;
  const float qx0 = s.from_sonar_object[0], qy0 = s.from_sonar_object[1], qz0 = s.from_sonar_object[2];
  const float px0 = s.from_sonar[0], py0 = s.from_sonar[1], pz0 = s.from_sonar[2];
  const float r0 = s.range_m, r0_squared = r0 * r0;
  const float m00 = s.turn[0], m01 = s.turn[1], m02 = s.turn[2], m10 = s.turn[3], m11 = s.turn[4], m12 = s.turn[5];
  const float m20 = s.turn[6], m21 = s.turn[7], m22 = s.turn[8];
  const RangeWindow window = range_window(s, g);
  const Lanes first_column = all(static_cast<float>(g.first_column)), end_column = all(static_cast<float>(g.last_column));
  const Lanes lowest = all(s.from_tangent), highest = all(s.to_tangent), nearest = all(window.from_m),
              farthest = all(window.to_m);
  const int row = g.bins + 1;
  const Lanes last_bin = all(static_cast<float>(g.bins) - bin_rounding);
  // The bounds are those of the cell's own column, not of the group, so that visibility does not depend on the grouping of
  // columns.
  const Lanes map_first = all(static_cast<float>(g.map_first_column)), last_in_fan = all(static_cast<float>(g.fan_columns - 1));
  const float beside = static_cast<float>(g.columns_beside);
  int m = 0;
  // r^2 = r0^2 + e with e = d . (2 q + d), d the cell's offset from the tile's centre. This avoids a difference of large
  // numbers.
  for (int i = from; i < from + n; i += lanes) {
    const Lanes dx = unit * counts(tx + i), dy = unit * counts(ty + i), dz = unit * counts(tz + i);
    const Lanes e = dx * (2 * qx0 + dx) + dy * (2 * qy0 + dy) + dz * (2 * qz0 + dz);
    Lanes inverse_r;
    const Lanes r = root_and_inverse(larger(r0_squared + e, all(1e-6f)), inverse_r);
    const Lanes x = px0 + m00 * dx + m01 * dy + m02 * dz;
    const Lanes y = py0 + m10 * dx + m11 * dy + m12 * dz;
    const Lanes z = pz0 + m20 * dx + m21 * dy + m22 * dz;
    // Elevations refer to x; for flat beams, to the horizontal distance.
    const Lanes inverse_h = conical ? reciprocal(larger(x, all(1e-6f))) : inverse_root(larger(x * x + y * y, all(1e-12f)));
    const Lanes column = (g.first_edge_sine - y * (conical ? inverse_r : inverse_h)) * g.columns_per_sine;
    // Direction of the cell from the origin of the rays. The sonar may have turned since the rays were traced.
    Lanes seen_column = column, seen_z = z, seen_inverse_h = inverse_h;
    if (moves) {
      const float *w = s.seen_turn, *o = s.seen_place;
      const Lanes there_x = o[0] + w[0] * x + w[1] * y + w[2] * z, there_y = o[1] + w[3] * x + w[4] * y + w[5] * z;
      seen_z = o[2] + w[6] * x + w[7] * y + w[8] * z;
      const Lanes across = there_x * there_x + there_y * there_y;
      seen_inverse_h = conical ? reciprocal(larger(there_x, all(1e-6f))) : inverse_root(larger(across, all(1e-12f)));
      const Lanes over_range = conical ? inverse_root(larger(across + seen_z * seen_z, all(1e-12f))) : seen_inverse_h;
      const Lanes wanted = (g.first_edge_sine - there_y * over_range) * g.columns_per_sine;
      const Lanes own = as_floats(whole_part(larger(column, all(0))));
      seen_column = smaller(larger(wanted, larger(own - beside, all(0))), smaller(own + beside, last_in_fan));
    }
    const Lanes tangent = seen_z * seen_inverse_h, steepness = magnitude(tangent);
    LaneMask keep = both(not_below(column, first_column), below(column, end_column));
    keep = both(keep, both(not_below(steepness, lowest), below(steepness, highest)));
    keep = both(keep, both(not_below(r, nearest), below(r, farthest)));
    keep = both(keep, below(all(1e-6f), x));
    if (!any(keep)) continue;

    // Compares the cell's own 1 / x with the depth map between two bins, with the tolerances of docs/acoustics.md, section 3.
    // The parentheses select the function of this instruction set instead of the one that argument-dependent lookup would find.
    const Lanes bin_here = smaller((bin_of_tangent<Lanes>)(g.axis, choose(keep, tangent, all(0))), last_bin);
    const LaneNumbers bin_below = whole_part(bin_here);
    const Lanes column_here = choose(keep, seen_column, map_first);
    const LaneNumbers at = (whole_part(column_here) - g.map_first_column) * row + bin_below;
    Lanes a, b;
    gather_pairs(g.inverse_depth, at, a, b);
    const Lanes seen = a + (bin_here - as_floats(bin_below)) * (b - a);
    const Lanes tolerance = seen_inverse_h * (g.depth_tolerance_m * inverse_r + s.tolerance_share);
    keep = both(keep, not_below(seen_inverse_h + tolerance, seen));
    // r cos(alpha): normal times the vector from sonar to cell, object axes.
    const Lanes along = counts(nx + i) * (qx0 + dx) + counts(ny + i) * (qy0 + dy) + counts(nz + i) * (qz0 + dz);
    keep = both(keep, not_below(all(0), along * s.turned_away));
    if (!any(keep)) continue;
    const LaneMask others = g.has_upper_marks ? foreign_numbers(g, s.mark, at, a, b) : foreign_marks(s.mark, a, b);
    const LaneMask foreign = both(both(keep, below(seen_inverse_h - tolerance, seen)), others);
    if (any(foreign)) {
      const Lanes nearness = seen_inverse_h * (1.0f + contact_share + contact_m * inverse_r);
      keep = less(keep, both(foreign, hidden(g, at, seen, column_here, nearness)));
      if (!any(keep)) continue;
    }

    pack(c.range + m, keep, r);
    pack(c.offset + m, keep, quotient(e, r0 + r));
    pack(c.cosine + m, keep, magnitude(along) * (CellTile::normal_unit * inverse_r));
    const Lanes z2 = z * z, h2 = conical ? x * x : x * x + y * y;
    pack(c.sine2 + m, keep, quotient(z2, h2 + z2));
    pack(c.column + m, keep, column);
    pack_weights(t, i, keep, what, m, c);
    m += count_of(keep);
  }
  return m;
}

/// Replaces the cosines by the root of the material's scattering strength. Without a table, this root is the cosine itself
/// (Lambert's law).
__attribute__((noinline)) void apply_law(const float* __restrict law, int n, Chunk& c) {
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) c.cosine[i] = law_root(law, c.cosine[i]);
}

inline Lanes sine_of_turns(Lanes turns) {
  const Lanes x = turns - nearest_whole(turns);
  const Lanes folded = choose(below(all(0), x), all(0.5f), all(-0.5f)) - x;
  const Lanes y = 6.2831853071795865f * choose(below(all(0.25f), magnitude(x)), folded, x), y2 = y * y;
  const Lanes p = -1.6666667e-1f + y2 * (8.3333333e-3f + y2 * (-1.9841270e-4f + y2 * (2.7557319e-6f + y2 * -2.5052108e-8f)));
  return y + y * y2 * p;
}

/// Two-way pattern of cells at the squared sines w. In side lobes no polynomial is used, because it would need many terms.
inline Lanes pattern_of(const TileSeen& s, const GroupView& g, Lanes w) {
  if (!s.in_side_lobes) return elevation_pattern(g.elevation, w);
  const Lanes x = g.elevation_aperture * root_of(w);
  return side_lobe_pattern(x, sine_of_turns(0.5f * x));
}

/// Computes the amplitude and the carrier of every visible cell, times its speckle.
__attribute__((noinline)) void scatter_cells(const TileSeen& s, const GroupView& g, int n, const Chunk& c, EchoArrays out) {
  for (int i = 0; i < n; i += lanes) {
    const Lanes r = load(c.range + i), offset = load(c.offset + i), d = -g.decay_per_m * offset;
    // Eq. 6 for a cell: weight of its level, law, D_v, absorption relative to the tile's centre, 1 / r^2; then its phase and
    // its xi.
    const Lanes amplitude = s.amplitude * root_of(level_weight(s, r)) * load(c.cosine + i) * pattern_of(s, g, load(c.sine2 + i)) *
                            exp_near_0(d) * reciprocal(r * r);
    const Lanes turns = -(s.phase_turns + g.turns_per_m * offset);
    const Lanes cs = amplitude * sine_of_turns(turns + 0.25f), sn = amplitude * sine_of_turns(turns);
    const Lanes a = load(c.weight_re + i), b = load(c.weight_im + i);
    store(out.re + i, a * cs - b * sn);
    store(out.im + i, a * sn + b * cs);
    store(out.sample + i, r * g.samples_per_m - (g.sample_offset - s.sample_shift));
    *reinterpret_cast<LaneNumbers*>(out.column + i) = whole_part(load(c.column + i));
  }
}

/// Computes the power of every visible cell in expected-power mode. |xi|^2 is 1, so only the cell's area is needed; the carrier
/// is not.
__attribute__((noinline)) void power_of_cells(const TileSeen& s, const GroupView& g, int n, const Chunk& c, float* power) {
  for (int i = 0; i < n; i += lanes) {
    const Lanes r = load(c.range + i);
    Lanes loss;
    for (int l = 0; l < lanes; ++l) loss[l] = std::exp(-g.decay_per_m * c.offset[i + l]);
    const Lanes amplitude =
        s.area_amplitude * load(c.cosine + i) * pattern_of(s, g, load(c.sine2 + i)) * loss * reciprocal(r * r);
    store(power + i, amplitude * amplitude * level_weight(s, r) * load(c.area + i));
  }
}
inline void scatter_power(const TileSeen& s, const GroupView& g, int n, const Chunk& c, EchoArrays out) {
  power_of_cells(s, g, n, c, out.re);
  for (int i = 0; i < n; i += lanes) {
    store(out.im + i, Lanes{});
    store(out.sample + i, load(c.range + i) * g.samples_per_m - (g.sample_offset - s.sample_shift));
    *reinterpret_cast<LaneNumbers*>(out.column + i) = whole_part(load(c.column + i));
  }
}

int scatter_tile(const TileSeen& s, const GroupView& g, EchoArrays out) {
  Chunk c;
  const Wanted w{!g.expected_power, g.expected_power || out.power != nullptr};
  int appended = 0;
  for (int from = 0; from < s.tile->count; from += chunk) {
    const int n = s.tile->count - from < chunk ? s.tile->count - from : chunk;
    const int m = g.conical
                      ? (s.moves ? see_cells<true, true>(s, g, w, from, n, c) : see_cells<true, false>(s, g, w, from, n, c))
                      : (s.moves ? see_cells<false, true>(s, g, w, from, n, c) : see_cells<false, false>(s, g, w, from, n, c));
    if (m == 0) continue;
    if (s.law != nullptr) apply_law(s.law, m, c);
    if (g.expected_power)
      scatter_power(s, g, m, c, out);
    else
      scatter_cells(s, g, m, c, out);
    if (!g.expected_power && out.power != nullptr) power_of_cells(s, g, m, c, out.power);
    out = {out.sample + m, out.re + m, out.im + m, out.column + m, out.power != nullptr ? out.power + m : nullptr};
    appended += m;
  }
  return appended;
}
