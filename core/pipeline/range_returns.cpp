#include "core/pipeline/range_returns.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/sonar/bearings.hpp"

namespace sonar {
namespace {

constexpr double speckle_cell_m = 0.02;  // a surface keeps its speckle while a beam's centre stays within a cell of this size
constexpr std::uint32_t draws = 4096;    // number of draws; the range cells of all returns share them
constexpr double least_blur = 0.5;       // least half length of an echo in range cells

/// The position of a ray in a cell, -0.5 to 0.5, along an axis in one of `of` strata. Multiples of the golden ratio shift it
/// from line to line of the grid, so that rays meet horizontal and vertical edges at all positions in a cell. The start of each
/// line is random, so that no oblique edge stays between rays.
float place_in_cell(int stratum, int of, int line, int across_lines) {
  const auto n = static_cast<std::uint32_t>(across_lines),
             shift = static_cast<std::uint32_t>(line) * 0x9E3779B9u + n * n * 0x85EBCA6Bu;
  return (static_cast<float>(stratum) + static_cast<float>(shift >> 8) * 0x1p-24f) / static_cast<float>(of) - 0.5f;
}

/// True if the cosine of incidence differs from the given one by less than a twentieth.
bool is_inclined_alike(const RayPacket& p, int lane, double cosine) {
  const auto i = static_cast<std::size_t>(lane);
  const Vec3d normal = to_double({p.normal_x[i], p.normal_y[i], p.normal_z[i]});
  const double along = dot(normal, to_double({p.direction_x[i], p.direction_y[i], p.direction_z[i]}));
  const double square = along * along, wanted = cosine * cosine * dot(normal, normal);
  return square > 0.95 * 0.95 * wanted && square < 1.05 * 1.05 * wanted;
}

}  // namespace

void RangeReturn::share_among_cells(double cell_m) {
  const double from = std::max(0.0, range_m - half_m) / cell_m, to = (range_m + half_m) / cell_m, density = power / (to - from);
  first = static_cast<std::int32_t>(from), last = static_cast<std::int32_t>(to);
  of_first = first == last ? power : density * (static_cast<double>(first + 1) - from);
  of_each = first == last ? 0 : density;
  of_last = first == last ? 0 : density * (to - static_cast<double>(last));
}

RangeReturns::RangeReturns(const RayScene& scene, const PingRequest& request, double cell_m)
    : scene_(scene),
      request_(request),
      grid_(request),
      cell_m_(cell_m),
      world_from_sonar_(rotation_from(request.sonar_in_world.orientation)),
      origin_(to_float(request.sonar_in_world.position_m - scene.origin())) {
  const FrequencyMode& mode = request.model->modes[static_cast<std::size_t>(request.settings.mode)];
  const double depth_m = depth_from_z(request.sonar_in_world.position_m.z), hz = static_cast<double>(mode.centre_hz);
  const double true_mps = true_sound_speed_mps(request.water, depth_m);
  device_per_true_ = static_cast<double>(request.settings.device_sound_speed_mps) / true_mps;
  absorption_np_ = nepers_from_db(absorption_db_per_m(request.water, depth_m, hz));
  source_ = power_from_db(static_cast<double>(mode.source_level_db));
  for (std::uint32_t i = 0; i < draws; ++i) {
    const Random4 bits = philox(i, 0, 0, key_of(request.seed, Domain::range_speckle));
    draws_.push_back(complex_normal(bits.v[0], bits.v[1]));
  }
  for (const Material& material : scene.scene().materials) laws_.push_back(make_law(material, hz, true_mps, false));
  const auto angle = [](double rad) { return Angle{std::cos(rad), std::sin(rad)}; };
  const double scale = bearing_scale_of(request);
  column_step_rad_ = grid_.column_step_rad() * scale, row_step_rad_ = grid_.row_step_rad() * scale;
  for (int c = 0; c < grid_.columns; ++c) azimuth_.push_back(angle(true_angle_rad(grid_.azimuth_rad(c), scale)));
  for (int r = 0; r < grid_.rows; ++r) elevation_.push_back(angle(true_angle_rad(grid_.elevation_rad(r), scale)));
  rows_.resize(static_cast<std::size_t>(grid_.rows));
}

void RangeReturns::trace(Parallel& pool) {
  pool.for_each(rows_.size(), [&](std::size_t row, int) { trace(static_cast<int>(row)); });
  look_closer(pool);
  pool.for_each(rows_.size(), [&](std::size_t row, int) {
    for (RangeReturn& r : rows_[row].returns) r.share_among_cells(cell_m_);
  });
}

Vec3d RangeReturns::direction(int column, int row) const {
  const auto [ca, sa] = azimuth_[static_cast<std::size_t>(column)];
  const auto [ce, se] = elevation_[static_cast<std::size_t>(row)];
  return {ce * ca, ce * sa, se};
}

void RangeReturns::aim(RayPacket& p, int lane, Vec3 d) const {
  const auto i = static_cast<std::size_t>(lane);
  p.origin_x[i] = origin_.x, p.origin_y[i] = origin_.y, p.origin_z[i] = origin_.z;
  p.direction_x[i] = d.x, p.direction_y[i] = d.y, p.direction_z[i] = d.z;
  p.far[i] = static_cast<float>(request_.settings.range_m / device_per_true_);
}

void RangeReturns::trace(int row) {
  std::vector<RangeReturn> middles(static_cast<std::size_t>(grid_.columns));
  trace_middles(row, middles);
  Row& to = rows_[static_cast<std::size_t>(row)];
  to.returns.clear();
  to.begin.assign(middles.size() + 1, 0);
  for (int column = 0; column < grid_.columns; column += cells_a_packet) {
    RayPacket p{};
    const int cells = std::min(cells_a_packet, grid_.columns - column);
    for (int n = 0; n < cells; ++n) aim_around(column + n, row, {rays_across, rays_up}, 0, rays_around, p, n * rays_around);
    scene_.trace(p, 0xFFFFu >> (cells_a_packet - cells) * rays_around, true);
    for (int n = 0; n < cells; ++n) {
      const auto c = static_cast<std::size_t>(column + n);
      to.begin[c] = to.returns.size();
      compare_around(middles[c], p, n * rays_around, to.returns);
    }
  }
  to.begin.back() = to.returns.size();
}

void RangeReturns::trace_middles(int row, std::vector<RangeReturn>& middles) const {
  for (int from = 0; from < grid_.columns; from += RayPacket::size) {
    const int lanes = std::min(RayPacket::size, grid_.columns - from);
    RayPacket p{};
    for (int i = 0; i < lanes; ++i) aim(p, i, to_float(world_from_sonar_ * direction(from + i, row)));
    scene_.trace(p, lanes == RayPacket::size ? 0xFFFFu : (1u << lanes) - 1u, true);
    for (int i = 0; i < lanes; ++i)
      if (p.object[i] != RayPacket::miss) {
        RangeReturn& middle = middles[static_cast<std::size_t>(from + i)];
        middle = return_of(p, i, {1, 1});
        draw_speckle(p, i, middle);
        middle.rays = 0;  // the rays around it are counted later
      }
  }
}

/// Sets lanes of a packet to the rays of a cell's lattice, from `first_ray` on.
void RangeReturns::aim_around(int column, int row, Lattice lattice, int first_ray, int rays, RayPacket& p, int first_lane) const {
  // The calculation in the plane across the middle ray is accurate enough for a few tenths of a degree.
  const auto [ca, sa] = azimuth_[static_cast<std::size_t>(column)];
  const Vec3d ahead = direction(column, row), to_port{-sa, ca, 0};
  const double width = column_step_rad_ * elevation_[static_cast<std::size_t>(row)].cosine;
  const Vec3 x = to_float(world_from_sonar_ * ahead), y = to_float(-width * (world_from_sonar_ * to_port)),
             z = to_float(row_step_rad_ * (world_from_sonar_ * cross(ahead, to_port)));
  for (int ray = first_ray; ray < first_ray + rays; ++ray) {
    const int i = ray % lattice.across, j = ray / lattice.across;
    const int line = row * lattice.up + j, across_lines = column * lattice.across + i;
    const float b = place_in_cell(i, lattice.across, line, across_lines), c = place_in_cell(j, lattice.up, across_lines, line);
    const Vec3 d{x.x + b * y.x + c * z.x, x.y + b * y.y + c * z.y, x.z + b * y.z + c * z.z};
    const float to_unit = 1 / std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
    aim(p, first_lane + ray - first_ray, {d.x * to_unit, d.y * to_unit, d.z * to_unit});
  }
}

/// Appends the returns of the rays of a cell. Rays that hit the same surface as the middle ray form one return, which has the
/// range of the middle ray.
void RangeReturns::compare_around(RangeReturn& middle, const RayPacket& p, int first_lane, std::vector<RangeReturn>& to) const {
  const std::size_t first = to.size();
  const double about_m = 1.25 * middle.spread_m + 2 * cell_m_;  // a patch is not exactly flat
  double power = 0;
  for (int lane = first_lane; lane < first_lane + rays_around; ++lane) {
    if (p.object[lane] == RayPacket::miss) continue;
    const double range_m = static_cast<double>(p.far[lane]) * device_per_true_;
    const bool is_there = middle.power > 0 && p.object[lane] == middle.object && std::abs(range_m - middle.range_m) <= about_m;
    middle.rays += is_there;
    if (is_there && is_inclined_alike(p, lane, middle.cosine)) {
      power += middle.power / rays_around;
      continue;
    }
    const RangeReturn r = return_of(p, lane, {rays_across, rays_up});
    if (is_there)
      power += r.power;
    else
      add(r, p, lane, to, first);
  }
  middle.power = power;
  if (power > 0) to.push_back(middle);
}

/// Computes the echo of one ray of a cell's lattice.
RangeReturn RangeReturns::return_of(const RayPacket& p, int lane, Lattice lattice) const {
  const auto i = static_cast<std::size_t>(lane);
  const Rotation sonar_from_world = transposed(world_from_sonar_);
  const Vec3d normal = sonar_from_world * to_double({p.normal_x[i], p.normal_y[i], p.normal_z[i]});
  const Vec3d along = sonar_from_world * to_double({p.direction_x[i], p.direction_y[i], p.direction_z[i]});
  const double size = length(normal), range_m = static_cast<double>(p.far[i]);
  if (!(size > 0)) return {};
  const double cosine = std::abs(dot(normal, along)) / size;
  const LawTable& law = laws_[scene_.scene().objects[p.object[i]].mesh->material[p.triangle[i]]];
  const double root = static_cast<double>(law.root_strength(static_cast<float>(cosine)));
  const double level = std::hypot(along.x, along.y);  // cosine of the elevation
  const double width = column_step_rad_ * level / lattice.across, height = row_step_rad_ / lattice.up;
  const double area_m2 = footprint_area_m2(cosine, range_m, width * height);
  const double loss = two_way_transmission(range_m, absorption_np_);
  // Change of the range over the patch of the ray: dr = -r (n . d') / (n . d) along both axes of the grid.
  const Vec3d to_port{-along.y / level, along.x / level, 0};
  const Vec3d up{-along.z * along.x / level, -along.z * along.y / level, level};
  const double slope = std::abs(dot(normal, to_port)) * width + std::abs(dot(normal, up)) * height;
  RangeReturn r;
  r.rays = 1;
  r.cosine = cosine;
  r.spread_m = range_m * slope / size / std::max(cosine, cosine_floor) / 2;
  r.range_m = range_m * device_per_true_;
  r.half_m = std::min(r.spread_m + least_blur * cell_m_, longest_return_half_m);
  r.power = source_ * loss * loss * root * root * area_m2;
  r.object = p.object[i];
  return r;
}

/// Sets the speckle of the point that a ray hit.
void RangeReturns::draw_speckle(const RayPacket& p, int lane, RangeReturn& r) const {
  const auto i = static_cast<std::size_t>(lane);
  const auto cell = [](float origin, float direction, float far) {
    return static_cast<std::uint32_t>(
        static_cast<std::int32_t>(std::floor(static_cast<double>(origin + direction * far) / speckle_cell_m)));
  };
  const Random4 bits =
      philox(cell(p.origin_x[i], p.direction_x[i], p.far[i]), cell(p.origin_y[i], p.direction_y[i], p.far[i]),
             cell(p.origin_z[i], p.direction_z[i], p.far[i]) ^ p.object[i] << 16, key_of(request_.seed, Domain::range_speckle));
  r.speckle = complex_normal(bits.v[0], bits.v[1]);
  r.draw = bits.v[2];
}

/// Adds a return to the returns of one cell, which begin at `first`. Rays that hit the same object at about the same range form
/// one return.
void RangeReturns::add(const RangeReturn& r, const RayPacket& p, int lane, std::vector<RangeReturn>& to,
                       std::size_t first) const {
  if (!(r.power > 0)) return;
  for (std::size_t n = first; n < to.size(); ++n) {
    RangeReturn& o = to[n];
    if (o.object != r.object || std::abs(o.range_m - r.range_m) > cell_m_ / 2) continue;
    const double moved_m = (r.range_m - o.range_m) * r.power / (o.power + r.power);
    o.half_m = std::min(std::max(o.half_m, r.half_m) + std::abs(moved_m), longest_return_half_m);
    o.range_m += moved_m;
    o.power += r.power;
    o.rays += r.rays;
    return;
  }
  to.push_back(r);
  draw_speckle(p, lane, to.back());
}

std::vector<PointReturn> RangeReturns::of_points() const {
  std::vector<PointReturn> points;
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
    r.share_among_cells(cell_m_);
    points.push_back(r);
  }
  return points;
}

}  // namespace sonar
