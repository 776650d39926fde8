#include "core/pipeline/range_image.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/base/random.hpp"
#include "core/pipeline/arithmetic/receiver.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/scattering_law.hpp"
#include "core/sonar/water.hpp"

namespace sonar {
namespace {

constexpr double reach = 1.1;            // in beam widths: the pattern is -14 dB there, and 0 beyond
constexpr double longest_half_m = 0.5;   // of the ranges of one ray's patch, at grazing incidence
constexpr double speckle_cell_m = 0.02;  // surfaces keep their speckle as long as a beam's centre stays within such a cell
constexpr double least_blur = 0.5;       // of a range cell: half the length of the shortest echo

/// Hit of one ray, or a point target: an echo spread evenly over range_m -+ half_m in the device's metres.
struct Return {
  double range_m = 0, half_m = 0, power = 0;  // power [uPa^2] in a beam that looks there; 0 = nothing
  ComplexNormal speckle{1, 0};
  std::uint32_t object = BeamTruth::nothing;
};
struct PointReturn : Return {
  double azimuth_rad = 0, elevation_rad = 0;
};

/// The share of an even spread that lies in cell k of width `cell`.
double share(const Return& r, double cell, std::ptrdiff_t k) {
  const double from = std::max(r.range_m - r.half_m, static_cast<double>(k) * cell);
  const double to = std::min(r.range_m + r.half_m, static_cast<double>(k + 1) * cell);
  return to > from ? (to - from) / (2 * r.half_m) : 0;
}

/// Two-way power pattern: a Gaussian of this -3 dB width.
double pattern(double angle_rad, double width_rad) {
  const double x = angle_rad / width_rad;
  return std::abs(x) > reach ? 0 : std::exp(-4 * std::log(2.0) * x * x);
}

/// Power by range cell of one beam; sums of even spreads are kept as steps until finish().
class Profile {
 public:
  explicit Profile(double cell_m, std::size_t cells) : cell_(cell_m), steps_(cells + 2, 0.0) {}
  void clear() {
    std::fill(steps_.begin() + first_, steps_.begin() + std::max(first_, std::min(last_ + 2, size())), 0.0);
    first_ = size();
    last_ = 0;
  }
  void add(const Return& r, double weight) {
    const double from = std::max(0.0, r.range_m - r.half_m) / cell_, to = (r.range_m + r.half_m) / cell_;
    const auto a = static_cast<std::ptrdiff_t>(from), b = static_cast<std::ptrdiff_t>(to);
    if (b + 2 > size()) return;  // beyond the picture
    const double power = r.power * weight, density = power / (to - from);
    first_ = std::min(first_, a);
    last_ = std::max(last_, b);
    if (a == b) {
      step(a, power);
      step(a + 1, -power);
      return;
    }
    const double of_first = density * (static_cast<double>(a + 1) - from), of_last = density * (to - static_cast<double>(b));
    step(a, of_first);
    step(a + 1, density - of_first);
    step(b, of_last - density);
    step(b + 1, -of_last);
  }
  /// Turns steps into powers.
  void finish() {
    double sum = 0;
    for (std::ptrdiff_t k = first_; k <= last_; ++k) sum = at(k) = std::max(0.0, sum + at(k));
  }
  bool empty() const { return first_ > last_; }
  std::ptrdiff_t first() const { return first_; }
  std::ptrdiff_t last() const { return last_; }
  double power(std::ptrdiff_t k) const { return k < first_ || k > last_ ? 0 : steps_[static_cast<std::size_t>(k)]; }
  /// Centre of the cells around k that have at least half its power [m].
  double centre_m(std::ptrdiff_t k) const {
    const double half = power(k) / 2;
    double sum = 0, moment = 0;
    const auto take = [&](std::ptrdiff_t i) {
      sum += power(i);
      moment += power(i) * (static_cast<double>(i) + 0.5);
    };
    std::ptrdiff_t from = k, to = k;
    while (power(from - 1) > half) --from;
    while (power(to + 1) > half) ++to;
    // The next cells, too: the place within a cell is in how an echo is shared among its neighbours.
    for (std::ptrdiff_t i = from - 1; i <= to + 1; ++i) take(i);
    return sum > 0 ? moment / sum * cell_ : (static_cast<double>(k) + 0.5) * cell_;
  }

 private:
  std::ptrdiff_t size() const { return static_cast<std::ptrdiff_t>(steps_.size()); }
  double& at(std::ptrdiff_t k) { return steps_[static_cast<std::size_t>(k)]; }
  void step(std::ptrdiff_t k, double by) { at(k) += by; }
  double cell_;
  std::vector<double> steps_;
  std::ptrdiff_t first_ = 0, last_ = 0;
};

class RangeImager {
 public:
  RangeImager(const RayScene& scene, const PingRequest& request, const RangeImageSettings& wanted)
      : scene_(scene),
        request_(request),
        wanted_(wanted),
        settings_(request.settings),
        mode_(request.model->modes[static_cast<std::size_t>(settings_.mode)]),
        grid_(request),
        cell_m_(static_cast<double>(settings_.pulse_width_m)),
        world_from_sonar_(rotation_from(request.sonar_in_world.orientation)),
        origin_(to_float(request.sonar_in_world.position_m - scene.origin())) {
    const double depth_m = depth_from_z(request.sonar_in_world.position_m.z), hz = static_cast<double>(mode_.centre_hz);
    const double true_mps = true_sound_speed_mps(request.water, depth_m);
    device_per_true_ = static_cast<double>(settings_.device_sound_speed_mps) / true_mps;
    absorption_np_ = nepers_from_db(absorption_db_per_m(request.water, depth_m, hz));
    source_ = power_from_db(static_cast<double>(mode_.source_level_db));
    for (const Material& material : scene.scene().materials) laws_.push_back(make_law(material, hz, true_mps, false));
    cells_ = static_cast<std::size_t>(std::ceil((settings_.range_m + longest_half_m) / cell_m_)) + 2;
    FrequencyMode beam = mode_;  // the level of the noise is that of one beam
    beam.pattern.elevation_width_rad = static_cast<float>(wanted.beam_height_rad);
    const double rms = noise_rms_upa(beam, true_mps / (2 * cell_m_));
    noise_power_ = rms * rms;
    column_reach_ = static_cast<int>(reach * static_cast<double>(mode_.pattern.azimuth_width_rad) / grid_.column_step_rad());
    row_reach_ = static_cast<int>(reach * wanted.beam_height_rad / grid_.row_step_rad());
    for (int d = -column_reach_; d <= column_reach_; ++d)
      column_weight_.push_back(pattern(d * grid_.column_step_rad(), static_cast<double>(mode_.pattern.azimuth_width_rad)));
    for (int d = -row_reach_; d <= row_reach_; ++d)
      row_weight_.push_back(pattern(d * grid_.row_step_rad(), wanted.beam_height_rad));
    returns_.resize(static_cast<std::size_t>(grid_.columns) * static_cast<std::size_t>(grid_.rows));
  }

  Ping run(Parallel& pool) {
    Ping ping;
    ping.request = request_;
    for (int c = 0; c < grid_.columns; ++c) ping.beam_azimuth_rad.push_back(static_cast<float>(grid_.azimuth_rad(c)));
    ping.samples.resize(4 * returns_.size());
    if (request_.switches.keep_pressure) ping.pressure_upa.resize(returns_.size());
    const auto rows = static_cast<std::size_t>(grid_.rows);
    if (!request_.blank) {
      pool.for_each(rows, [&](std::size_t row, int) { trace(static_cast<int>(row)); });
      find_points();
    }
    std::vector<Profile> profiles(static_cast<std::size_t>(pool.threads()), Profile(cell_m_, cells_));
    pool.for_each(rows, [&](std::size_t row, int worker) {
      Profile& profile = profiles[static_cast<std::size_t>(worker)];
      for (int column = 0; column < grid_.columns; ++column) {
        const std::size_t index = row * static_cast<std::size_t>(grid_.columns) + static_cast<std::size_t>(column);
        const Reported reported = pixel(column, static_cast<int>(row), static_cast<std::uint32_t>(index), profile);
        const std::uint32_t code = code_of(reported).code();
        if (!ping.pressure_upa.empty()) ping.pressure_upa[index] = static_cast<float>(std::sqrt(reported.power));
        for (std::size_t b = 0; b < 4; ++b) ping.samples[4 * index + b] = static_cast<std::byte>(code >> (8 * b) & 0xFF);
      }
    });
    if (request_.switches.keep_truth) ping.truth = truth();
    return ping;
  }

 private:
  /// Value of a pixel before it is quantised; power 0 = no return.
  struct Reported {
    double power = 0, range_m = 0;  // [uPa^2], the device's metres
  };
  Return& at(int column, int row) {
    return returns_[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.columns) + static_cast<std::size_t>(column)];
  }

  void trace(int row) {
    const double elevation = grid_.elevation_rad(row), ce = std::cos(elevation), se = std::sin(elevation);
    for (int from = 0; from < grid_.columns; from += RayPacket::size) {
      const int lanes = std::min(RayPacket::size, grid_.columns - from);
      RayPacket p{};
      std::array<Vec3d, RayPacket::size> along;  // of the ray, sonar axes
      for (int i = 0; i < lanes; ++i) {
        const auto lane = static_cast<std::size_t>(i);
        const double azimuth = grid_.azimuth_rad(from + i);
        along[lane] = {ce * std::cos(azimuth), ce * std::sin(azimuth), se};
        const Vec3 d = to_float(world_from_sonar_ * along[lane]);
        p.origin_x[lane] = origin_.x, p.origin_y[lane] = origin_.y, p.origin_z[lane] = origin_.z;
        p.direction_x[lane] = d.x, p.direction_y[lane] = d.y, p.direction_z[lane] = d.z;
        p.far[lane] = static_cast<float>(settings_.range_m / device_per_true_);
      }
      scene_.trace(p, lanes == RayPacket::size ? 0xFFFFu : (1u << lanes) - 1u, true);
      for (int i = 0; i < lanes; ++i)
        if (p.object[i] != RayPacket::miss) at(from + i, row) = met(p, i, along[static_cast<std::size_t>(i)], ce);
    }
  }

  Return met(const RayPacket& p, int lane, Vec3d along, double cosine_elevation) const {
    const auto i = static_cast<std::size_t>(lane);
    const Vec3d normal = transposed(world_from_sonar_) * to_double({p.normal_x[i], p.normal_y[i], p.normal_z[i]});
    const double size = length(normal), range_m = static_cast<double>(p.far[i]);
    if (!(size > 0)) return {};
    const double toward = dot(normal, along) / size, cosine = std::abs(toward);
    const Mesh& mesh = *scene_.scene().objects[p.object[i]].mesh;
    const LawTable& law = laws_[mesh.material[p.triangle[i]]];
    const double root = static_cast<double>(law.root_strength(static_cast<float>(cosine)));
    const double width = grid_.column_step_rad() * cosine_elevation, height = grid_.row_step_rad();
    const double area_m2 = footprint_area_m2(cosine, range_m, width * height);
    const double loss = two_way_transmission(range_m, absorption_np_);
    // How the range changes over the patch of the ray: dr = -r (n . d') / (n . d) along both axes of the grid.
    const double level = std::hypot(along.x, along.y);
    const Vec3d to_port{-along.y / level, along.x / level, 0};
    const Vec3d up{-along.z * along.x / level, -along.z * along.y / level, level};
    const double slope = std::abs(dot(normal, to_port)) * width + std::abs(dot(normal, up)) * height;
    const double spread = range_m * slope / size / std::max(cosine, cosine_floor) / 2;
    Return r;
    r.range_m = range_m * device_per_true_;
    r.half_m = std::min(spread + least_blur * cell_m_, longest_half_m);
    r.power = source_ * loss * loss * root * root * area_m2;
    const auto cell = [](float origin, float direction, float far) {
      return static_cast<std::uint32_t>(
          static_cast<std::int32_t>(std::floor(static_cast<double>(origin + direction * far) / speckle_cell_m)));
    };
    const Random4 bits =
        philox(cell(p.origin_x[i], p.direction_x[i], p.far[i]), cell(p.origin_y[i], p.direction_y[i], p.far[i]),
               cell(p.origin_z[i], p.direction_z[i], p.far[i]) ^ p.object[i] << 16, key_of(request_.seed, Domain::range_speckle));
    r.speckle = complex_normal(bits.v[0], bits.v[1]);
    r.object = p.object[i];
    return r;
  }

  void find_points() {
    for (const PointTarget& point : scene_.scene().point_targets) {
      const Vec3d place = scene_.scene().in_world(point, request_.bodies_in_world);
      const Vec3d from_sonar = transposed(world_from_sonar_) * (place - request_.sonar_in_world.position_m);
      const double range_m = length(from_sonar), loss = two_way_transmission(range_m, absorption_np_);
      if (!(loss > 0) || is_occluded(scene_, request_.sonar_in_world.position_m, place)) continue;
      PointReturn r;
      r.range_m = range_m * device_per_true_;
      r.half_m = least_blur * cell_m_;
      r.power = source_ * loss * loss * power_from_db(static_cast<double>(point.target_strength_db));
      r.azimuth_rad = std::atan2(from_sonar.y, from_sonar.x);
      r.elevation_rad = std::atan2(from_sonar.z, std::hypot(from_sonar.x, from_sonar.y));
      points_.push_back(r);
    }
  }

  /// Calls f(return, power weight) for all that a beam receives.
  template <class F>
  void for_each_return(int column, int row, F f) {
    for (int r = std::max(row - row_reach_, 0); r <= std::min(row + row_reach_, grid_.rows - 1); ++r)
      for (int c = std::max(column - column_reach_, 0); c <= std::min(column + column_reach_, grid_.columns - 1); ++c)
        if (const Return& met = at(c, r); met.power > 0)
          f(met, row_weight_[static_cast<std::size_t>(r - row + row_reach_)] *
                     column_weight_[static_cast<std::size_t>(c - column + column_reach_)]);
    for (const PointReturn& point : points_) {
      const double weight =
          pattern(point.azimuth_rad - grid_.azimuth_rad(column), static_cast<double>(mode_.pattern.azimuth_width_rad)) *
          pattern(point.elevation_rad - grid_.elevation_rad(row), wanted_.beam_height_rad);
      if (weight > 0) f(point, weight);
    }
  }

  /// Linear strength of an amplitude [uPa] from a range, in the unit of the pixels.
  double strength(double amplitude, double range_m) const {
    const double gain_db = static_cast<double>(settings_.gain_db) +
                           (settings_.tvg ? tvg_db(mode_.receiver, range_m, settings_.device_absorption_db_per_m) : 0);
    return amplitude * full_scale_factor(mode_.receiver, gain_db) * static_cast<double>(settings_.format.max_code >> 16);
  }
  double center_of(std::ptrdiff_t k) const { return (static_cast<double>(k) + 0.5) * cell_m_; }
  double least_power() const { return request_.switches.noise ? wanted_.detection * noise_power_ : 0; }
  bool is_detected(double power, double range_m) const {
    return power > least_power() && strength(std::sqrt(power), range_m) >= static_cast<double>(wanted_.least_strength);
  }

  /// The cell within the ranges wanted that is reported; nothing in it is loud enough: the strongest all the same.
  std::ptrdiff_t chosen(const Profile& profile) const {
    std::ptrdiff_t best = profile.first();
    bool any = false;
    for (std::ptrdiff_t k = profile.first(); k <= profile.last(); ++k) {
      if (center_of(k) < settings_.range_start_m || center_of(k) > settings_.range_m) continue;
      if (!any || profile.power(k) > profile.power(best)) best = k, any = true;
      const bool is_peak = profile.power(k) >= profile.power(k + 1) && profile.power(k) > profile.power(k - 1);
      if (wanted_.nearest && is_peak && is_detected(profile.power(k), center_of(k))) return k;
    }
    return best;
  }

  Reported pixel(int column, int row, std::uint32_t index, Profile& profile) {
    const Random4 bits =
        philox(static_cast<std::uint32_t>(request_.number), request_.sonar_id, index, key_of(request_.seed, Domain::range_noise));
    profile.clear();
    for_each_return(column, row, [&](const Return& r, double weight) { profile.add(r, weight); });
    profile.finish();
    double power = 0, range_m = 0;
    if (!profile.empty()) {
      const std::ptrdiff_t k = chosen(profile);
      power = profile.power(k);
      range_m = profile.centre_m(k);
      if (!request_.switches.expected_power) {
        // Rays are shared by neighbouring beams, and so is their speckle.
        double re = 0, im = 0;
        for_each_return(column, row, [&](const Return& r, double weight) {
          const double amplitude = std::sqrt(r.power * weight * share(r, cell_m_, k));
          re += amplitude * static_cast<double>(r.speckle.re);
          im += amplitude * static_cast<double>(r.speckle.im);
        });
        if (request_.switches.noise) {
          const ComplexNormal noise = complex_normal(bits.v[0], bits.v[1]);
          re += std::sqrt(noise_power_) * static_cast<double>(noise.re);
          im += std::sqrt(noise_power_) * static_cast<double>(noise.im);
        }
        power = re * re + im * im;
        if (request_.switches.noise && power > least_power())  // an echo's place is as sure as it stands above the noise
          range_m += cell_m_ / 2 * std::sqrt(noise_power_ / power) * static_cast<double>(complex_normal(bits.v[2], bits.v[3]).re);
      }
    }
    if (!is_detected(power, range_m) && request_.switches.noise && !request_.switches.expected_power) {
      // The loudest of all cells of noise, which is a false alarm if it passes.
      const double cells = static_cast<double>(cells_);
      power = -noise_power_ * std::log(-std::expm1(std::log(static_cast<double>(uniform_open(bits.v[2]))) / cells));
      range_m = settings_.range_m * static_cast<double>(uniform_open(bits.v[3]));
    }
    if (!is_detected(power, range_m) || range_m < settings_.range_start_m || range_m > settings_.range_m) return {};
    return {power, range_m};
  }

  RangePixel code_of(const Reported& r) const {
    if (r.power == 0) return {};
    const auto held = [](double value, std::uint32_t most) {
      return static_cast<std::uint32_t>(std::clamp(value + 0.5, 1.0, static_cast<double>(most)));
    };
    return {held(strength(std::sqrt(r.power), r.range_m), RangePixel::most_strength),
            held(r.range_m / wanted_.range_unit_m, RangePixel::most_range)};
  }

  /// The nearest hit of each column's rays.
  std::vector<BeamTruth> truth() {
    std::vector<BeamTruth> nearest(static_cast<std::size_t>(grid_.columns));
    for (int column = 0; column < grid_.columns; ++column)
      for (int row = 0; row < grid_.rows; ++row) {
        const Return& r = at(column, row);
        BeamTruth& beam = nearest[static_cast<std::size_t>(column)];
        const auto range_m = static_cast<float>(r.range_m / device_per_true_);
        if (r.power > 0 && (beam.range_m == 0 || range_m < beam.range_m)) beam = {range_m, r.object};
      }
    return nearest;
  }

  const RayScene& scene_;
  const PingRequest& request_;
  const RangeImageSettings& wanted_;
  const PingSettings& settings_;
  const FrequencyMode& mode_;
  RangeImageGrid grid_;
  double cell_m_;
  Rotation world_from_sonar_;
  Vec3 origin_;
  double device_per_true_ = 1, absorption_np_ = 0, source_ = 1, noise_power_ = 0;
  std::size_t cells_ = 0;
  std::vector<LawTable> laws_;
  int column_reach_ = 0, row_reach_ = 0;
  std::vector<double> column_weight_, row_weight_;
  std::vector<Return> returns_;  // [rows][columns]
  std::vector<PointReturn> points_;
};

}  // namespace

Ping make_range_image(const RayScene& scene, const PingRequest& request, const RangeImageSettings& wanted, Parallel& pool) {
  return RangeImager(scene, request, wanted).run(pool);
}

}  // namespace sonar
