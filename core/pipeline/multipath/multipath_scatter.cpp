#include "core/pipeline/multipath/multipath_scatter.hpp"

#include <algorithm>
#include <cmath>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/scene/cells/cell_lattice.hpp"

namespace sonar {
namespace {

constexpr float least_transmit = 1e-3f;  // columns with a lower amplitude of the transmitter receive nothing

void store(Vec3d v, float (&to)[3]) {
  to[0] = static_cast<float>(v.x), to[1] = static_cast<float>(v.y), to[2] = static_cast<float>(v.z);
}

/// The product without the checks for infinities that the standard library's product contains.
std::complex<float> times(std::complex<float> a, std::complex<float> b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

float level_weight(const CellLevel& level, float r) {
  const auto part = [](float from, float to, float x) {
    return to > from ? (x - from) / (to - from) : (x >= from ? 1.0f : 0.0f);
  };
  return cross_fade(part(level.fade_in_from_m, level.full_from_m, r), 1.0f - part(level.full_to_m, level.fade_out_to_m, r));
}

}  // namespace

PathReach::PathReach(const Path& path, const ImagePaths& image_paths, const PingPlan& plan, const PingScalars& s)
    : path_(path), image_paths_(image_paths), plan_(plan), longest_m_(2 * s.max_range_m) {
  const auto angle = [&](int bin) {
    return std::atan(
        static_cast<double>(image_paths.map.fan.first_tangent + static_cast<float>(bin) / image_paths.map.fan.bins_per_tangent));
  };
  // Adds one bin on either side, because cells between two nodes are included.
  for (std::size_t block = 0; block < image_paths.map.windows.size(); ++block) {
    const PathWindow& w = image_paths.map.window(block, path);
    spans_.push_back(w.empty() ? Span{} : Span{angle(w.first_bin - 1), angle(w.last_bin + 1)});
  }
}

/// A ball is reachable if its image lies within the record, on the lit side of the last mirror, and within the columns and
/// elevations of the path in the traced map.
std::optional<DistanceSpan> PathReach::seen_between(Vec3d place, double radius) const {
  const Vec3d image = path_.image_of(place);
  const double r = length(image);
  // The shortest pair uses this path for one way and the straight path for the other. The surface of the ball may be nearer
  // than its centre by one radius on each way.
  if (r + length(place) - 2 * radius > longest_m_) return {};
  if (path_.first >= 0) {
    const FlatMirror& last = image_paths_.mirrors[static_cast<std::size_t>(path_.second < 0 ? path_.first : path_.second)];
    if ((path_.beyond_front ? last.height_of(place) : -last.height_of(place)) < -radius) return {};
  }
  const bool conical = plan_.switches.conical;
  const double flat = std::sqrt(image.x * image.x + image.y * image.y);
  const double from_axis = conical ? r : flat, blocks = static_cast<double>(spans_.size());
  double first_block = 0, last_block = blocks - 1;
  if (from_axis > 2 * radius) {
    // The range of u of the ball: u of its centre, plus and minus the radius divided by its shortest distance from the array.
    const double sine = image.y / from_axis, spread = radius / (from_axis - radius);
    const auto block = [&](double u) {
      return std::floor(((plan_.columns.first_sine - u) / plan_.columns.spacing + 0.5) / BounceMap::block_columns);
    };
    first_block = std::max(block(sine + spread + plan_.columns.spacing), first_block);
    last_block = std::min(block(sine - spread - plan_.columns.spacing), last_block);
  }
  const double across = conical ? std::sqrt(image.x * image.x + image.z * image.z) : r;
  const bool anywhere = across <= radius;
  // psi of the image, and half the angle of the ball about the array axis [rad].
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
  // Horner's scheme: sum_n (-1)^n x^n / (2 n + 1)!.
  float p = -1.0f / 1.307674368e12f;  // sin(y) / y in powers of x = y^2
  p = p * x + 1.0f / 6227020800.0f;
  p = p * x - 1.0f / 39916800.0f;
  p = p * x + 1.0f / 362880.0f;
  p = p * x - 1.0f / 5040.0f;
  p = p * x + 1.0f / 120.0f;
  p = p * x - 1.0f / 6.0f;
  return p * x + 1;
}

MultipathScatterer::MultipathScatterer(const PingContext& context, const ImagePaths& image_paths,
                                       const std::vector<PathReach>& reach, const std::vector<float>& beam_correlation)
    : image_paths_(image_paths),
      reach_(reach),
      cells_(context.cells),
      laws_(context.laws),
      beam_correlation_(beam_correlation),
      plan_(context.plan),
      s_(context.scalars),
      pattern_(plan_.mode.pattern),
      first_edge_sine_(static_cast<float>(plan_.columns.first_sine + plan_.columns.spacing / 2)),
      columns_per_sine_(static_cast<float>(1 / plan_.columns.spacing)),
      tolerance_m_(plan_.depth_tolerance_m()),
      absorption_np_per_m_(static_cast<float>(s_.absorption_np_per_m)),
      half_turns_per_m_(static_cast<float>(0.5 * s_.turns_per_m)),
      turned_away_(context.turned_away) {}

MultipathScatterer::TilePath MultipathScatterer::look_at(const TileInView& tile, const Path& path) const {
  TilePath tile_path{};
  tile_path.path = &path;
  const Rotation& sonar_from_object = cells_.sonar_from_object(tile.object);
  const EchoGeometry at = s_.echo_geometry(path.image_of(tile.from_sonar_m));
  // The image of a tile is its reflection. Its axes are reflected, too, and may become left-handed.
  const Rotation turn = (s_.moves ? at.turn * path.turn : path.turn) * sonar_from_object;
  const double range = length(at.from_sonar_m);
  store(at.from_sonar_m, tile_path.from_sonar);
  store(transposed(turn) * at.from_sonar_m, tile_path.from_sonar_object);
  for (int i = 0; i < 9; ++i) tile_path.turn[i] = static_cast<float>(turn.m[i / 3][i % 3]);
  tile_path.range_m = static_cast<float>(range);
  tile_path.sample_shift = static_cast<float>(s_.doppler_samples(at.from_sonar_m));
  tile_path.half_turns = static_cast<float>(fraction_of_turn(0.5 * range * s_.turns_per_m));
  // The factor e^{-a r} of eq. 10 for one way to the tile's centre. arrive() adds the rest for each cell.
  tile_path.amplitude = static_cast<float>(std::exp(-s_.absorption_np_per_m * range));
  if (image_paths_.bubbles.present())
    tile_path.amplitude *= static_cast<float>(bubble_factor(image_paths_.bubbles, path, image_paths_.mirrors, tile_middle_, s_));
  tile_path.reflection = 1;
  if (path.first >= 0) {
    const FlatMirror& first = image_paths_.mirrors[static_cast<std::size_t>(path.first)];
    tile_path.reflection = static_cast<float>(first.reflection);
    // Normals times sqrt(2) k h. With them the loss of a mirror is e^{-(n . d)^2}, d the unit direction.
    store(std::sqrt(first.twice_kh_squared) * first.normal, tile_path.rough_normal[0]);
    const FlatMirror& last = image_paths_.mirrors[static_cast<std::size_t>(path.second < 0 ? path.first : path.second)];
    const double side = path.beyond_front ? 1 : -1;
    store(transposed(sonar_from_object) * (side * last.normal), tile_path.lit_normal);
    if (path.second >= 0) {
      tile_path.reflection *= static_cast<float>(last.reflection);
      store(std::sqrt(last.twice_kh_squared) * path.second_normal, tile_path.rough_normal[1]);
    }
    tile_path.lit_height = static_cast<float>(side * last.height_of(tile.from_sonar_m) - touching_m);
  }
  return tile_path;
}

void MultipathScatterer::scatter(const TileInView& tile, std::vector<Echoes>& by_group) {
  tile_paths_.clear();
  tile_middle_ = tile.from_sonar_m + cells_.sonar_from_object(tile.object) * tile.tile->middle_cell_m();
  const double radius = static_cast<double>(tile.tile->half_edge_m) * 1.7320508;
  tile_paths_.push_back(look_at(tile, image_paths_.paths[0]));
  for (std::size_t l = 1; l < image_paths_.paths.size(); ++l)
    if (reach_[l].seen_between(tile.from_sonar_m, radius)) tile_paths_.push_back(look_at(tile, image_paths_.paths[l]));
  if (tile_paths_.size() == 1) return;

  away_ = turned_away_[static_cast<std::size_t>(tile.object)];
  const CellTile& t = *tile.tile;
  const LawTable& law = laws_[static_cast<std::size_t>(t.material)];
  // The factors of eq. 10 that are constant over a tile: 10^(SL/20) sqrt(mu). The weights are as in scatter.cpp.
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
    // |xi|^2 = 1 and A_c = cell area / |normal along the dominant axis|.
    if (plan_.expected_power) cell.weight = root_area / std::sqrt(std::max(std::abs(cell.normal[t.axis]), 1e-3f));
    scatter_cell(cell, law, *tile.level, by_group);
  }
}

void MultipathScatterer::scatter_cell(const Cell& cell, const LawTable& law, const CellLevel& level,
                                      std::vector<Echoes>& by_group) {
  const auto offset_of = [&cell](const TilePath& w, float& range_m) {  // sets the range; returns it minus the tile centre's
    const float* q = w.from_sonar_object;
    // r^2 = r0^2 + e, with e from the cell's offset. This avoids a difference of large floats.
    const float e = cell.x * (2 * q[0] + cell.x) + cell.y * (2 * q[1] + cell.y) + cell.z * (2 * q[2] + cell.z);
    range_m = std::sqrt(std::max(w.range_m * w.range_m + e, 1e-6f));
    return e / (w.range_m + range_m);
  };
  // One-way arrivals of the cell by each path; the direct path is the first.
  arrivals_.clear();
  Arrival arrival{};
  float range_m = 0;
  for (std::size_t w = 1; w < tile_paths_.size(); ++w) {
    const TilePath& tile_path = tile_paths_[w];
    if (cell.x * tile_path.lit_normal[0] + cell.y * tile_path.lit_normal[1] + cell.z * tile_path.lit_normal[2] +
            tile_path.lit_height <=
        0)
      continue;
    const float offset = offset_of(tile_path, range_m);
    if (arrive(tile_path, cell, range_m, offset, law, arrival)) arrivals_.push_back(arrival);
  }
  if (arrivals_.empty()) return;
  const float offset = offset_of(tile_paths_[0], range_m);
  direct_ = arrive(tile_paths_[0], cell, range_m, offset, law, arrival);
  if (direct_) arrivals_.insert(arrivals_.begin(), arrival);
  // All paths use the cell level of the shortest path, because their echoes must come from the same scatterers.
  float shortest_m = arrivals_[0].range_m;
  for (const Arrival& a : arrivals_) shortest_m = std::min(shortest_m, a.range_m);
  const float fade = level_weight(level, shortest_m);
  if (fade > 0) pair_up(cell, fade, by_group);
}

bool MultipathScatterer::is_visible(const Path& path, int column, float bin, float nearness) const {
  const BounceMap& map = image_paths_.map;
  const auto whole = static_cast<int>(bin);
  const BounceMap::Node* below = map.nodes.data() + static_cast<std::ptrdiff_t>(column) * (map.fan.bins + 1) + whole;
  const float part = bin - static_cast<float>(whole);
  const bool up = part >= 0.5f;
  // The map is interpolated between two nodes only where both belong to the path.
  const BounceMap::Node &nearest = below[up ? 1 : 0], &other = below[up ? 0 : 1];
  const auto belongs = [&path](const BounceMap::Node& node) {
    return (path.first < 0 || node.mirror[0] == path.first) && (path.second < 0 || node.mirror[1] == path.second);
  };
  if (!belongs(nearest)) return false;
  const int stage = path.first < 0 ? 0 : path.second < 0 ? 1 : 2;
  const float share = up ? 1 - part : part;  // weight of the other node
  const float at_nearest = nearest.inverse_x[stage];
  const float seen = belongs(other) ? at_nearest + share * (other.inverse_x[stage] - at_nearest) : at_nearest;
  return nearness >= seen;
}

bool MultipathScatterer::arrive(const TilePath& w, const Cell& cell, float r, float offset, const LawTable& law,
                                Arrival& out) const {
  // The cell's image in the axes of reception [m].
  const float x = w.from_sonar[0] + w.turn[0] * cell.x + w.turn[1] * cell.y + w.turn[2] * cell.z;
  if (x <= 1e-6f || r < static_cast<float>(nearest_scatterer_m)) return false;
  const float y = w.from_sonar[1] + w.turn[3] * cell.x + w.turn[4] * cell.y + w.turn[5] * cell.z;
  const float z = w.from_sonar[2] + w.turn[6] * cell.x + w.turn[7] * cell.y + w.turn[8] * cell.z;
  const float h = plan_.switches.conical ? x : std::sqrt(x * x + y * y);
  out.sine = y / (plan_.switches.conical ? r : h);
  const float column = (first_edge_sine_ - out.sine) * columns_per_sine_;
  if (!(column >= 0) || column >= static_cast<float>(plan_.columns.count)) return false;
  const BounceFan& fan = image_paths_.map.fan;
  const float bin = (z / h - fan.first_tangent) * fan.bins_per_tangent;
  if (!(bin >= 0) || bin >= static_cast<float>(fan.bins)) return false;
  out.column = static_cast<int>(column);
  const float inverse_r = 1 / r;
  if (!is_visible(*w.path, out.column, bin, (1 + tolerance_m_ * inverse_r) / h)) return false;

  const float* q = w.from_sonar_object;
  // cos(alpha) at the cell, from the image's direction. Its sign gives the side of the surface.
  const float along = cell.normal[0] * (q[0] + cell.x) + cell.normal[1] * (q[1] + cell.y) + cell.normal[2] * (q[2] + cell.z);
  if (along * away_ > 0) return false;
  // One-way factor m_i / r_i D(psi_i) e^{-a r_i} (sigma_b)^(1/4). The product of two such factors contains the geometric mean
  // of eq. 10.
  out.range_m = r;
  out.sample_shift = w.sample_shift;
  out.front = along > 0;
  out.transmit = plan_.columns.transmit[static_cast<std::size_t>(out.column)];
  // Rc exp(-2 k^2 h^2 cos^2) of each mirror, and absorption.
  const auto rough = [&](const float(&n)[3]) { return (n[0] * x + n[1] * y + n[2] * z) * inverse_r; };
  const float first = rough(w.rough_normal[0]), second = rough(w.rough_normal[1]);
  const float loss = std::exp(-first * first - second * second - absorption_np_per_m_ * offset);
  out.size = w.reflection * w.amplitude * loss * pattern_(z * z / (h * h + z * z)) *
             std::sqrt(law.relative_root(std::min(std::abs(along) * inverse_r, 1.0f))) * inverse_r;
  // Eq. 12 for one way: the turns of the tile's centre, plus the turns of the cell in float.
  const float turns = w.half_turns + half_turns_per_m_ * offset;
  const float phase = static_cast<float>(-2 * pi) * (turns - static_cast<float>(static_cast<int>(turns)));
  out.carried = {out.size * std::cos(phase), out.size * std::sin(phase)};
  return true;
}

void MultipathScatterer::pair_up(const Cell& cell, float fade, std::vector<Echoes>& by_group) const {
  // The range of samples whose pulses reach into the record.
  const float per_m = static_cast<float>(s_.samples_per_m), from = static_cast<float>(s_.sample_offset);
  const auto first = static_cast<float>(-plan_.taps / 2), last = static_cast<float>(plan_.samples + plan_.taps / 2 - 1);
  for (std::size_t i = 0; i < arrivals_.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      const Arrival &a = arrivals_[i], &b = arrivals_[j];
      if (i == 0 && direct_) continue;  // the direct pair has no mirror
      // A surface scatters only to the side from which the sound arrives.
      if (a.front != b.front) continue;
      // The echo appears at the range (r_i + r_j) / 2 and at the bearing of the path back.
      const float sample = 0.5f * (a.range_m + b.range_m) * per_m - from + 0.5f * (a.sample_shift + b.sample_shift);
      if (sample <= first || sample >= last) continue;
      const auto add_arrival = [&](const Arrival& out, const Arrival& back, std::complex<float> amplitude) {
        // finish_columns() multiplies by the transmitter's amplitude in the receiving column. The transmit path of this pair
        // lies in another column, which the factor here corrects.
        if (back.transmit < least_transmit || out.transmit == 0) return;
        const float lit = out.transmit / back.transmit;
        add(sample, amplitude * (plan_.expected_power ? lit * lit : lit), back.column, by_group);
      };
      if (!plan_.expected_power) {
        // Levels cross-fade in power, so amplitudes are multiplied by the root.
        const std::complex<float> amplitude = times(times(std::sqrt(fade) * cell.weight, a.carried), b.carried);
        add_arrival(a, b, amplitude);
        if (i != j) add_arrival(b, a, amplitude);
        continue;
      }
      // Mean power |A_ij|^2. For the pair ij, ji the cross term 2 |A_ij A_ji| gamma (eq. 21) between their columns is added.
      const float root = cell.weight.real() * a.size * b.size, power = fade * root * root;
      add_arrival(a, b, power);
      if (i == j) continue;
      add_arrival(b, a, power);
      // Both arrivals come from one scatterer at one time. In beams that receive both, the amplitudes add (gamma = common).
      const int between = (a.column + b.column) / 2;
      const float lit = plan_.columns.transmit[static_cast<std::size_t>(between)];
      const float common = beam_correlation(a, b);
      if (common > 0 && lit >= least_transmit)
        add(sample, 2 * common * power * a.transmit * b.transmit / (lit * lit), between, by_group);
    }
}

void MultipathScatterer::add(float sample, std::complex<float> amplitude, int column, std::vector<Echoes>& by_group) const {
  Echoes& echoes = by_group[static_cast<std::size_t>(column / group_columns)];
  if (echoes.count == echoes.capacity()) echoes.reserve(std::max(1024, 2 * echoes.count));
  const auto i = static_cast<std::size_t>(echoes.count++);
  echoes.sample[i] = sample;
  echoes.re[i] = amplitude.real(), echoes.im[i] = amplitude.imag();
  echoes.column[i] = column;
}

float MultipathScatterer::beam_correlation(const Arrival& a, const Arrival& b) const {
  // Interpolates linearly between whole columns.
  const float apart = std::abs(a.sine - b.sine) / static_cast<float>(plan_.columns.spacing);
  const auto n = static_cast<std::size_t>(apart);
  if (n + 1 >= beam_correlation_.size()) return 0;
  return beam_correlation_[n] + (apart - static_cast<float>(n)) * (beam_correlation_[n + 1] - beam_correlation_[n]);
}

std::vector<float> beam_correlation_over_columns(const PingPlan& plan) {
  const ReceivePattern pattern = receive_pattern(plan.mode.pattern);
  // gamma(n) = sum_k W_k W_{k+n} / sum_k W_k^2 (eq. 21).
  const int half = std::min(plan.beam_weights.half_band, plan.columns.count / 2);
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
