#include "core/pipeline/multipath/multipath_scatter.hpp"

#include <algorithm>
#include <cmath>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/scene/cells/cell_lattice.hpp"

namespace sonar {
namespace {

constexpr float least_transmit = 1e-3f;  // columns lit by less are not received from

void store(Vec3d v, float (&to)[3]) {
  to[0] = static_cast<float>(v.x), to[1] = static_cast<float>(v.y), to[2] = static_cast<float>(v.z);
}

/// Without the care that the library's product takes of infinities.
std::complex<float> times(std::complex<float> a, std::complex<float> b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

/// Root of the scattering strength over that of mu, at a cosine of incidence.
float law_root(const LawTable& law, float cosine) {
  if (law.root.empty()) return cosine;
  const float at = static_cast<float>(simd::law_steps) * std::sqrt(std::max(1.0f - cosine, 0.0f));
  const auto step = static_cast<std::size_t>(at);
  return law.root[step] + (at - static_cast<float>(step)) * (law.root[step + 1] - law.root[step]);
}

float cross_fade(const CellLevel& level, float r) {
  const auto part = [](float from, float to, float x) {
    return to > from ? (x - from) / (to - from) : (x >= from ? 1.0f : 0.0f);
  };
  const float in = part(level.fade_in_from_m, level.full_from_m, r);
  const float out = 1.0f - part(level.full_to_m, level.fade_out_to_m, r);
  return std::clamp(std::min(in, out), 0.0f, 1.0f);
}

}  // namespace

LegReach::LegReach(const Leg& leg, const Ways& ways, const PingPlan& plan, const PingScalars& s)
    : leg_(leg), ways_(ways), plan_(plan), longest_m_(2 * s.max_range_m) {
  const auto angle = [&](int bin) {
    return std::atan(static_cast<double>(ways.map.fan.first_tangent + static_cast<float>(bin) / ways.map.fan.bins_per_tangent));
  };
  for (std::size_t block = 0; block < ways.map.windows.size(); ++block) {
    const LegWindow& w = ways.map.window(block, leg);
    spans_.push_back(w.empty() ? Span{} : Span{angle(w.first_bin - 1), angle(w.last_bin + 1)});
  }
}

std::optional<DistanceSpan> LegReach::seen_between(Vec3d place, double radius) const {
  const Vec3d image = leg_.image_of(place);
  const double r = length(image);
  if (r + length(place) - 2 * radius > longest_m_) return {};
  if (leg_.first >= 0) {
    const FlatMirror& last = ways_.mirrors[static_cast<std::size_t>(leg_.second < 0 ? leg_.first : leg_.second)];
    if ((leg_.beyond_front ? last.height_of(place) : -last.height_of(place)) < -radius) return {};
  }
  const bool conical = plan_.switches.conical;
  const double flat = std::sqrt(image.x * image.x + image.y * image.y);
  const double from_axis = conical ? r : flat, blocks = static_cast<double>(spans_.size());
  double first_block = 0, last_block = blocks - 1;
  if (from_axis > 2 * radius) {
    const double sine = image.y / from_axis, spread = radius / (from_axis - radius);
    const auto block = [&](double u) {
      return std::floor(((plan_.columns.first_sine - u) / plan_.columns.spacing + 0.5) / BounceMap::block_columns);
    };
    first_block = std::max(block(sine + spread + plan_.columns.spacing), first_block);
    last_block = std::min(block(sine - spread - plan_.columns.spacing), last_block);
  }
  const double across = conical ? std::sqrt(image.x * image.x + image.z * image.z) : r;
  const bool anywhere = across <= radius;
  const double angle = std::atan2(image.z, conical ? image.x : flat), spread = anywhere ? pi : std::asin(radius / across);
  for (double b = first_block; b <= last_block; ++b) {
    const Span& span = spans_[static_cast<std::size_t>(b)];
    if (span.low_rad <= span.high_rad && angle - spread <= span.high_rad && angle + spread >= span.low_rad)
      return DistanceSpan{r - radius, r + radius};
  }
  return {};
}

OneWayPattern::OneWayPattern(const BeamPattern& pattern)
    : aperture_(pattern.elevation_taper == Taper::unit ? 0.0f : static_cast<float>(elevation_aperture_in_wavelengths(pattern))) {}

float OneWayPattern::operator()(float squared_sine) const {
  const float a = static_cast<float>(pi) * aperture_, x = a * a * squared_sine;  // x < 9: inside the first zero
  float p = -1.0f / 1.307674368e12f;                                             // sin(a) / a, powers of x
  p = p * x + 1.0f / 6227020800.0f;
  p = p * x - 1.0f / 39916800.0f;
  p = p * x + 1.0f / 362880.0f;
  p = p * x - 1.0f / 5040.0f;
  p = p * x + 1.0f / 120.0f;
  p = p * x - 1.0f / 6.0f;
  return p * x + 1;
}

GhostScatterer::GhostScatterer(const Ways& ways, const std::vector<LegReach>& reach, const SurfaceCells& cells,
                               const std::vector<LawTable>& laws, const std::vector<float>& beam_correlation,
                               const PingPlan& plan, const PingScalars& scalars)
    : ways_(ways),
      reach_(reach),
      cells_(cells),
      laws_(laws),
      beam_correlation_(beam_correlation),
      plan_(plan),
      s_(scalars),
      pattern_(plan.mode.pattern),
      first_edge_sine_(static_cast<float>(plan.columns.first_sine + plan.columns.spacing / 2)),
      columns_per_sine_(static_cast<float>(1 / plan.columns.spacing)),
      tolerance_m_(plan.depth_tolerance_m()),
      absorption_np_per_m_(static_cast<float>(scalars.absorption_np_per_m)),
      half_turns_per_m_(static_cast<float>(0.5 * scalars.turns_per_m)) {}

GhostScatterer::Way GhostScatterer::look_at(const TileInView& tile, const Leg& leg) const {
  Way way{};
  way.leg = &leg;
  const Rotation& sonar_from_object = cells_.sonar_from_object(tile.object);
  const Meeting at = s_.meet(leg.image_of(tile.from_sonar_m));
  const Rotation turn = (s_.moves ? at.turn * leg.turn : leg.turn) * sonar_from_object;
  const double range = length(at.from_sonar_m);
  store(at.from_sonar_m, way.from_sonar);
  store(transposed(turn) * at.from_sonar_m, way.from_sonar_object);
  for (int i = 0; i < 9; ++i) way.turn[i] = static_cast<float>(turn.m[i / 3][i % 3]);
  way.range_m = static_cast<float>(range);
  way.sample_shift = static_cast<float>(s_.doppler_samples(at.from_sonar_m));
  way.half_turns = static_cast<float>(fraction_of_turn(0.5 * range * s_.turns_per_m));
  way.amplitude = static_cast<float>(std::exp(-s_.absorption_np_per_m * range));
  if (ways_.bubbles.present())
    way.amplitude *= static_cast<float>(bubble_factor(ways_.bubbles, leg, ways_.mirrors, tile_middle_, s_));
  way.reflection = 1;
  if (leg.first >= 0) {
    const FlatMirror& first = ways_.mirrors[static_cast<std::size_t>(leg.first)];
    way.reflection = static_cast<float>(first.reflection);
    store(std::sqrt(first.twice_kh_squared) * first.normal, way.rough_normal[0]);
    const FlatMirror& last = ways_.mirrors[static_cast<std::size_t>(leg.second < 0 ? leg.first : leg.second)];
    const double side = leg.beyond_front ? 1 : -1;
    store(transposed(sonar_from_object) * (side * last.normal), way.lit_normal);
    if (leg.second >= 0) {
      way.reflection *= static_cast<float>(last.reflection);
      store(std::sqrt(last.twice_kh_squared) * leg.second_normal, way.rough_normal[1]);
    }
    way.lit_height = static_cast<float>(side * last.height_of(tile.from_sonar_m) - touching_m);
  }
  return way;
}

void GhostScatterer::sound(const TileInView& tile, std::vector<Echoes>& by_group) {
  tile_ways_.clear();
  tile_middle_ = tile.from_sonar_m + cells_.sonar_from_object(tile.object) * tile.tile->middle_cell_m();
  const double radius = static_cast<double>(tile.tile->half_edge_m) * 1.7320508;
  tile_ways_.push_back(look_at(tile, ways_.legs[0]));
  for (std::size_t l = 1; l < ways_.legs.size(); ++l)
    if (reach_[l].seen_between(tile.from_sonar_m, radius)) tile_ways_.push_back(look_at(tile, ways_.legs[l]));
  if (tile_ways_.size() == 1) return;

  const CellTile& t = *tile.tile;
  const LawTable& law = laws_[static_cast<std::size_t>(t.material)];
  const double constant = s_.source_upa * std::sqrt(law.mu);
  const auto unit = static_cast<float>(constant * static_cast<double>(t.weight_unit));
  const auto root_area = static_cast<float>(constant * lattice::cell_size_m(t.level));
  const auto value = [&t](CellTile::Column c, int i) { return static_cast<float>(t.column(c)[i]); };
  for (int i = 0; i < t.count; ++i) {
    const std::complex<float> weight(value(CellTile::weight_re, i), value(CellTile::weight_im, i));
    if (weight == 0.0f) continue;  // padding
    Cell cell{t.position_unit_m * value(CellTile::x, i),
              t.position_unit_m * value(CellTile::y, i),
              t.position_unit_m * value(CellTile::z, i),
              {},
              unit * weight};
    for (int k = 0; k < 3; ++k)
      cell.normal[k] = CellTile::normal_unit * value(static_cast<CellTile::Column>(CellTile::normal_x + k), i);
    if (plan_.expected_power) cell.weight = root_area / std::sqrt(std::max(std::abs(cell.normal[t.axis]), 1e-3f));
    sound_cell(cell, law, *tile.level, by_group);
  }
}

void GhostScatterer::sound_cell(const Cell& cell, const LawTable& law, const CellLevel& level, std::vector<Echoes>& by_group) {
  const auto offset_of = [&cell](const Way& w, float& range_m) {  // range, and range less that of the tile's centre
    const float* q = w.from_sonar_object;
    const float e = cell.x * (2 * q[0] + cell.x) + cell.y * (2 * q[1] + cell.y) + cell.z * (2 * q[2] + cell.z);
    range_m = std::sqrt(std::max(w.range_m * w.range_m + e, 1e-6f));
    return e / (w.range_m + range_m);
  };
  arrivals_.clear();
  Arrival arrival{};
  float range_m = 0;
  for (std::size_t w = 1; w < tile_ways_.size(); ++w) {
    const Way& way = tile_ways_[w];
    if (cell.x * way.lit_normal[0] + cell.y * way.lit_normal[1] + cell.z * way.lit_normal[2] + way.lit_height <= 0) continue;
    const float offset = offset_of(way, range_m);
    if (arrive(way, cell, range_m, offset, law, arrival)) arrivals_.push_back(arrival);
  }
  if (arrivals_.empty()) return;
  const float offset = offset_of(tile_ways_[0], range_m);
  direct_ = arrive(tile_ways_[0], cell, range_m, offset, law, arrival);
  if (direct_) arrivals_.insert(arrivals_.begin(), arrival);
  // All ways share the cells that the shortest calls for: their echoes must be of the same scatterers.
  float shortest_m = arrivals_[0].range_m;
  for (const Arrival& a : arrivals_) shortest_m = std::min(shortest_m, a.range_m);
  const float fade = cross_fade(level, shortest_m);
  if (fade > 0) pair_up(cell, fade, by_group);
}

bool GhostScatterer::is_visible(const Leg& leg, int column, float bin, float nearness) const {
  const BounceMap& map = ways_.map;
  const auto whole = static_cast<int>(bin);
  const BounceMap::Node* below = map.nodes.data() + static_cast<std::ptrdiff_t>(column) * (map.fan.bins + 1) + whole;
  const float part = bin - static_cast<float>(whole);
  const bool up = part >= 0.5f;
  const BounceMap::Node &nearest = below[up ? 1 : 0], &other = below[up ? 0 : 1];
  const auto belongs = [&leg](const BounceMap::Node& node) {
    return (leg.first < 0 || node.mirror[0] == leg.first) && (leg.second < 0 || node.mirror[1] == leg.second);
  };
  if (!belongs(nearest)) return false;
  const int stage = leg.first < 0 ? 0 : leg.second < 0 ? 1 : 2;
  const float share = up ? 1 - part : part;  // of the other node
  const float at_nearest = nearest.inverse_x[stage];
  const float seen = belongs(other) ? at_nearest + share * (other.inverse_x[stage] - at_nearest) : at_nearest;
  return nearness >= seen;
}

bool GhostScatterer::arrive(const Way& w, const Cell& cell, float r, float offset, const LawTable& law, Arrival& out) const {
  const float x = w.from_sonar[0] + w.turn[0] * cell.x + w.turn[1] * cell.y + w.turn[2] * cell.z;
  if (x <= 1e-6f || r < static_cast<float>(nearest_scatterer_m)) return false;
  const float y = w.from_sonar[1] + w.turn[3] * cell.x + w.turn[4] * cell.y + w.turn[5] * cell.z;
  const float z = w.from_sonar[2] + w.turn[6] * cell.x + w.turn[7] * cell.y + w.turn[8] * cell.z;
  const float h = plan_.switches.conical ? x : std::sqrt(x * x + y * y);
  out.sine = y / (plan_.switches.conical ? r : h);
  const float column = (first_edge_sine_ - out.sine) * columns_per_sine_;
  if (!(column >= 0) || column >= static_cast<float>(plan_.columns.count)) return false;
  const BounceFan& fan = ways_.map.fan;
  const float bin = (z / h - fan.first_tangent) * fan.bins_per_tangent;
  if (!(bin >= 0) || bin >= static_cast<float>(fan.bins)) return false;
  out.column = static_cast<int>(column);
  const float inverse_r = 1 / r;
  if (!is_visible(*w.leg, out.column, bin, (1 + tolerance_m_ * inverse_r) / h)) return false;

  const float* q = w.from_sonar_object;
  const float along = cell.normal[0] * (q[0] + cell.x) + cell.normal[1] * (q[1] + cell.y) + cell.normal[2] * (q[2] + cell.z);
  out.range_m = r;
  out.sample_shift = w.sample_shift;
  out.front = along > 0;
  out.transmit = plan_.columns.transmit[static_cast<std::size_t>(out.column)];
  // Rc exp(-2 k^2 h^2 cos^2) of each mirror, and absorption.
  const auto rough = [&](const float(&n)[3]) { return (n[0] * x + n[1] * y + n[2] * z) * inverse_r; };
  const float first = rough(w.rough_normal[0]), second = rough(w.rough_normal[1]);
  const float loss = std::exp(-first * first - second * second - absorption_np_per_m_ * offset);
  out.size = w.reflection * w.amplitude * loss * pattern_(z * z / (h * h + z * z)) *
             std::sqrt(law_root(law, std::min(std::abs(along) * inverse_r, 1.0f))) * inverse_r;
  const float turns = w.half_turns + half_turns_per_m_ * offset;
  const float phase = static_cast<float>(-2 * pi) * (turns - static_cast<float>(static_cast<int>(turns)));
  out.carried = {out.size * std::cos(phase), out.size * std::sin(phase)};
  return true;
}

void GhostScatterer::pair_up(const Cell& cell, float fade, std::vector<Echoes>& by_group) const {
  const float per_m = static_cast<float>(s_.samples_per_m), from = static_cast<float>(s_.sample_offset);
  const auto first = static_cast<float>(-plan_.taps / 2), last = static_cast<float>(plan_.samples + plan_.taps / 2 - 1);
  for (std::size_t i = 0; i < arrivals_.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      const Arrival &a = arrivals_[i], &b = arrivals_[j];
      if (i == 0 && direct_) continue;  // straight out and back is no ghost
      if (a.front != b.front) continue;
      const float sample = 0.5f * (a.range_m + b.range_m) * per_m - from + 0.5f * (a.sample_shift + b.sample_shift);
      if (sample <= first || sample >= last) continue;
      const auto heard = [&](const Arrival& out, const Arrival& back, std::complex<float> amplitude) {
        // finish_columns lights a column as the direct way out would; here the way out is another.
        if (back.transmit < least_transmit || out.transmit == 0) return;
        const float lit = out.transmit / back.transmit;
        add(sample, amplitude * (plan_.expected_power ? lit * lit : lit), back.column, by_group);
      };
      if (!plan_.expected_power) {
        const std::complex<float> amplitude = times(times(std::sqrt(fade) * cell.weight, a.carried), b.carried);
        heard(a, b, amplitude);
        if (i != j) heard(b, a, amplitude);
        continue;
      }
      const float root = cell.weight.real() * a.size * b.size, power = fade * root * root;
      heard(a, b, power);
      if (i == j) continue;
      heard(b, a, power);
      // The two are one scatterer heard twice at one time: where beams hear both, amplitudes add.
      const int between = (a.column + b.column) / 2;
      const float lit = plan_.columns.transmit[static_cast<std::size_t>(between)];
      const float common = beam_correlation(a, b);
      if (common > 0 && lit >= least_transmit)
        add(sample, 2 * common * power * a.transmit * b.transmit / (lit * lit), between, by_group);
    }
}

void GhostScatterer::add(float sample, std::complex<float> amplitude, int column, std::vector<Echoes>& by_group) const {
  Echoes& echoes = by_group[static_cast<std::size_t>(column / group_columns)];
  if (echoes.count == echoes.capacity()) echoes.reserve(std::max(1024, 2 * echoes.count));
  const auto i = static_cast<std::size_t>(echoes.count++);
  echoes.sample[i] = sample;
  echoes.re[i] = amplitude.real(), echoes.im[i] = amplitude.imag();
  echoes.column[i] = column;
}

float GhostScatterer::beam_correlation(const Arrival& a, const Arrival& b) const {
  const float apart = std::abs(a.sine - b.sine) / static_cast<float>(plan_.columns.spacing);
  const auto n = static_cast<std::size_t>(apart);
  if (n + 1 >= beam_correlation_.size()) return 0;
  return beam_correlation_[n] + (apart - static_cast<float>(n)) * (beam_correlation_[n + 1] - beam_correlation_[n]);
}

std::vector<float> beam_correlation_over_columns(const PingPlan& plan) {
  const ReceivePattern pattern = receive_pattern(plan.mode.pattern);
  const int half = std::min(plan.coupling.half_band, plan.columns.count / 2);
  std::vector<double> w;
  for (int k = -half; k <= half; ++k) w.push_back(pattern(k * plan.columns.spacing));
  std::vector<float> correlation;
  double whole = 0;
  for (std::size_t n = 0; n < w.size(); ++n) {
    double sum = 0;
    for (std::size_t k = 0; k + n < w.size(); ++k) sum += w[k] * w[k + n];
    if (n == 0) whole = sum;
    correlation.push_back(static_cast<float>(pattern.unit ? 1 : sum / whole));
  }
  return correlation;
}

}  // namespace sonar
