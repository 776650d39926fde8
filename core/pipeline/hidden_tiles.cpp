#include "core/pipeline/hidden_tiles.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sonar {
namespace {

struct Span {
  double low, high;
};
/// a / b for b > 0.
Span quotient(Span a, Span b) { return {a.low / (a.low < 0 ? b.low : b.high), a.high / (a.high > 0 ? b.low : b.high)}; }
Span magnitude(Span a) { return {a.low > 0 ? a.low : (a.high < 0 ? -a.high : 0), std::max(-a.low, a.high)}; }
Span root_of_squares(Span a, Span b, Span c = {0, 0}) {
  const auto root = [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); };
  a = magnitude(a), b = magnitude(b), c = magnitude(c);
  return {root(a.low, b.low, c.low), root(a.high, b.high, c.high)};
}
Span within(Span a, Span b) { return {std::max(a.low, b.low), std::min(a.high, b.high)}; }

/// The box around a tile's cells, in the axes of a sonar. It has a margin, because the positions of cells are in single
/// precision.
struct Box {
  Vec3d middle, half;
  double slack;

  Box(const CellTile& tile, const Rotation& turn, Vec3d centre_m, double range_m) : slack(1e-4 + 1e-5 * range_m) {
    middle = centre_m + turn * to_double(tile.box_middle_m);
    const Vec3d h = to_double(tile.box_half_m);
    const auto reach = [&](int i) {
      return std::abs(turn.m[i][0]) * h.x + std::abs(turn.m[i][1]) * h.y + std::abs(turn.m[i][2]) * h.z + slack;
    };
    half = {reach(0), reach(1), reach(2)};
  }
  Span x() const { return {middle.x - half.x, middle.x + half.x}; }
  Span y() const { return {middle.y - half.y, middle.y + half.y}; }
  Span z() const { return {middle.z - half.z, middle.z + half.z}; }
};

/// Directions u = y / r (y / h for flat beams) over a box that is small compared with its distance. There u is nearly linear.
Span sines_by_slope(const CellTile& tile, const Box& box, const Rotation& turn, bool conical) {
  constexpr Span any{-2, 2};
  const Vec3d half = to_double(tile.box_half_m), c = box.middle;
  const double from_axis = conical ? length(c) : std::sqrt(c.x * c.x + c.y * c.y);
  const double radius = length(half), nearest = from_axis - radius;
  if (nearest < radius) return any;
  const double sine = c.y / from_axis;
  // The gradient of u, in object axes; its second derivatives are at most 3 / r^2.
  const double along = -sine / from_axis;
  const Vec3d gradient = (1 / from_axis) * (transposed(turn) * Vec3d{along * c.x, 1 + along * c.y, conical ? along * c.z : 0});
  // First order: |du| <= sum |du/dx_i| half_i; second order: radius^2 / 2 times the bound 3 / r^2.
  const double spread = std::abs(gradient.x) * half.x + std::abs(gradient.y) * half.y + std::abs(gradient.z) * half.z +
                        1.5 * radius * radius / (nearest * nearest) + 1e-6;
  return {sine - spread, sine + spread};
}

/// Column k spans u = first_sine - (k -+ 1/2) spacing. The columns are rounded outwards, because one column too many takes
/// little time.
void find_columns(Span sine, const Columns& columns, PreparedTile& tile) {
  const double from = (columns.first_sine - sine.high) / columns.spacing + 0.5;
  const double to = (columns.first_sine - sine.low) / columns.spacing + 1.5;
  tile.first_column = static_cast<int>(std::clamp(std::floor(from), 0.0, static_cast<double>(columns.count)));
  tile.last_column = static_cast<int>(std::clamp(std::ceil(to), 0.0, static_cast<double>(columns.count)));
}

/// True if no cell of the tile is used: its ranges are outside those of its level or of the record, or its tangents are outside
/// those of the part of the fan to which it belongs.
bool out_of_view(const PingContext& context, const simd::TileSeen& seen, Span range, Span tangent) {
  const PingPlan& plan = context.plan;
  const PingScalars& s = context.scalars;
  const double shift = s.sample_offset - static_cast<double>(seen.sample_shift);
  const Span record{(-plan.taps / 2 - 1 + shift) / s.samples_per_m, (plan.samples + plan.taps / 2 + shift) / s.samples_per_m};
  const Span level{static_cast<double>(seen.fade_in_from_m), static_cast<double>(seen.fade_out_to_m)};
  const Span wanted = within(record, level), steepness = magnitude(tangent);
  constexpr double rounding = 1e-5;
  return range.high < wanted.low || range.low > wanted.high ||
         steepness.low > static_cast<double>(seen.to_tangent) * (1 + rounding) ||
         steepness.high < static_cast<double>(seen.from_tangent) * (1 - rounding);
}

}  // namespace

void find_reach(const PingContext& context, const Rotation& sonar_from_object, Vec3d from_sonar_m,
                const Rotation& seen_from_object, Vec3d seen_from_sonar_m, PreparedTile& out) {
  constexpr double nearest_m = 0.05;  // for boxes that are nearer, the directions are not limited
  const PingPlan& plan = context.plan;
  const simd::TileSeen& seen = out.seen;
  const CellTile& tile = *seen.tile;
  const bool conical = plan.switches.conical;
  const auto range_m = static_cast<double>(seen.range_m);
  const Box there(tile, seen_from_object, seen_from_sonar_m, range_m);
  const Box here = seen.moves ? Box(tile, sonar_from_object, from_sonar_m, range_m) : there;
  out.first_column = 0, out.last_column = plan.columns.count;
  out.first_bin = 0, out.last_bin = plan.fan.bins;
  out.nearest = std::numeric_limits<float>::infinity();

  const auto beside_axis = [conical](const Box& box) { return conical ? box.x() : root_of_squares(box.x(), box.y()); };
  // The calculation is in object axes, in which the box is smallest.
  const Vec3 m = tile.box_middle_m, h = tile.box_half_m;
  const auto edges = [&](float from, float middle, float half) {
    const double c = static_cast<double>(from) + static_cast<double>(middle), reach = static_cast<double>(half) + here.slack;
    return Span{c - reach, c + reach};
  };
  const float* q = seen.from_sonar_object;
  const Span range = root_of_squares(edges(q[0], m.x, h.x), edges(q[1], m.y, h.y), edges(q[2], m.z, h.z));
  const Span forward = beside_axis(there);
  const bool is_ahead = forward.low > nearest_m && range.low > nearest_m;
  const Span tangent = is_ahead ? quotient(there.z(), forward) : Span{-1e9, 1e9};
  if (here.x().high < 0 || out_of_view(context, seen, range, tangent)) {
    out.last_column = 0;
    return;
  }
  Span sine = sines_by_slope(tile, here, sonar_from_object, conical);
  if (is_ahead) sine = within(sine, quotient(here.y(), conical ? range : beside_axis(here)));
  find_columns(sine, plan.columns, out);
  if (!is_ahead) return;

  const auto bin = [&](double t, int more) {
    return std::clamp(static_cast<int>(bin_of_tangent(plan.fan.axis, static_cast<float>(t))) + more, 0, plan.fan.bins);
  };
  out.first_bin = bin(tangent.low, -1), out.last_bin = bin(tangent.high, 2);
  // The same comparison as in see_cells(): 1 / x with the tolerance of the map.
  constexpr double rounding = 1e-5;
  const double tolerance = static_cast<double>(plan.depth_tolerance_m()) / range.low + static_cast<double>(seen.tolerance_share);
  out.nearest = static_cast<float>((1 + tolerance) * (1 + rounding) / forward.low);
}

void FarthestSeen::shape(const DepthMap& map) {
  const int bins = map.bins + 1;
  first_column_ = map.first_column, end_column_ = map.first_column + map.columns;
  blocks_ = (bins + bins_a_block - 1) / bins_a_block;
  least_.clear();
  line_.resize(static_cast<std::size_t>(blocks_ * bins_a_block));
  std::fill(line_.begin() + bins, line_.end(), std::numeric_limits<float>::infinity());
  float* __restrict line = line_.data();
  for (int from = 0; from < map.columns; from += columns_a_block) {
    const float* column = map.inverse_x.data() + static_cast<std::ptrdiff_t>(from) * bins;
    std::copy_n(column, bins, line);
    for (int k = from + 1; k < std::min(from + columns_a_block, map.columns); ++k) {
      column += bins;
      for (int bin = 0; bin < bins; ++bin) line[bin] = column[bin] < line[bin] ? column[bin] : line[bin];
    }
    for (int block = 0; block < blocks_; ++block)
      least_.push_back(*std::min_element(line + block * bins_a_block, line + (block + 1) * bins_a_block));
  }
}

void FarthestSeen::leave_out_hidden(const std::vector<PreparedTile>& tiles, std::span<const std::uint32_t> wanted,
                                    const simd::GroupView& group, std::vector<std::uint32_t>& in_sight) const {
  in_sight.clear();
  for (const std::uint32_t i : wanted)
    if (!hides(tiles[i], group.first_column, group.last_column, group.columns_beside)) in_sight.push_back(i);
}

bool FarthestSeen::hides(const PreparedTile& tile, int first, int last, int beside) const {
  const int from = std::max(std::max(tile.first_column, first) - beside, first_column_);
  const int to = std::min(std::min(tile.last_column, last) + beside, end_column_);
  for (int c = (from - first_column_) / columns_a_block; c * columns_a_block < to - first_column_; ++c)
    for (int b = tile.first_bin / bins_a_block; b <= tile.last_bin / bins_a_block; ++b)
      if (!(least_[static_cast<std::size_t>(c * blocks_ + b)] > tile.nearest)) return false;
  return true;
}

}  // namespace sonar
