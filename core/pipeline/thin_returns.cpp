// The part of RangeReturns that traces thin objects (poles, ropes, chains) with more rays than the rest of the picture.
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/pipeline/range_returns.hpp"
#include "core/sonar/bearings.hpp"

namespace sonar {
namespace {

// If a smaller fraction of the rays in a cell and its eight neighbours hits an object, the object is thin. Thin objects are
// followed from cell to cell. The cells that they cross get many rays, because the distance of rays determines how accurately
// the covered part of a cell is known. `most_close_rays` limits the sum for all of these cells.
constexpr double thin_share = 0.4;
constexpr int probe_across = 12, most_across = 16, most_close_rays = 1 << 15;
// If thin objects cover the view, as a net does, only the usual rays are traced. To find thin cells, rays are also aimed at
// objects that the usual rays miss: at no more than most_aimed_at objects in view, and only until most_aimed_cells are found.
// Otherwise many specks would use up the cells that thin objects need.
constexpr std::size_t most_thin_cells = 512, most_probed_cells = 2048, most_aimed_at = 1024, most_aimed_cells = 128;

}  // namespace

/// Calls `f` for the cell and its neighbours.
template <class F>
void RangeReturns::for_each_neighbour(Cell cell, F f) const {
  for (int row = std::max(cell.row - 1, 0); row <= std::min(cell.row + 1, grid_.rows - 1); ++row)
    for (int column = std::max(cell.column - 1, 0); column <= std::min(cell.column + 1, grid_.columns - 1); ++column)
      f(Cell{column, row});
}

/// Aims rays at points on an object and adds the cells in which they hit it. Returns false if no point is in view and in range.
bool RangeReturns::aim_at(std::uint32_t object, std::vector<std::uint8_t>& is_listed, std::vector<Cell>& cells) const {
  const Object& o = scene_.scene().objects[object];
  const Pose in_world = scene_.scene().in_world(o, request_.bodies_in_world);
  const auto reported = [&](double rad) { return true_angle_rad(rad, 1 / bearing_scale_of(request_)); };
  RayPacket p{};
  Cell in[RayPacket::size];
  std::uint32_t active = 0;
  for (int i = 0; i < RayPacket::size && o.visible && !o.mesh->triangles.empty(); ++i) {
    const auto& corners = o.mesh->triangles[static_cast<std::size_t>(i) * o.mesh->triangles.size() / RayPacket::size];
    const auto corner = [&](std::size_t n) { return to_double(o.mesh->vertices[corners[n]]); };
    const double b = std::fmod(0.7549 * (i + 1), 1), c = (1 - b) * std::fmod(0.5698 * (i + 1), 1);
    const Vec3d place = transform(in_world, (1 - b - c) * corner(0) + b * corner(1) + c * corner(2));
    const Vec3d to = transposed(world_from_sonar_) * (place - request_.sonar_in_world.position_m);
    if (!(to.x > 0 && length(to) * device_per_true_ <= request_.settings.range_m)) continue;
    const double column = (grid_.azimuth_rad(0) - reported(std::atan2(to.y, to.x))) / grid_.column_step_rad();
    const double row = (reported(std::atan2(to.z, std::hypot(to.x, to.y))) - grid_.elevation_rad(0)) / grid_.row_step_rad();
    if (!(column >= 0 && column <= grid_.columns - 1 && row >= 0 && row <= grid_.rows - 1)) continue;
    in[i] = {static_cast<int>(std::lround(column)), static_cast<int>(std::lround(row))};
    aim(p, i, to_float(world_from_sonar_ * (1 / length(to) * to)));
    active |= 1u << i;
  }
  scene_.trace(p, active, false);
  for (int i = 0; i < RayPacket::size; ++i)
    if (p.object[i] == object && !std::exchange(is_listed[index(in[i])], std::uint8_t{1})) cells.push_back(in[i]);
  return active != 0;
}

/// Lists the cells with hits of a thin object. An object is thin if it is so in most of its cells, or if the usual rays miss it.
std::vector<RangeReturns::Cell> RangeReturns::thin_cells(std::vector<std::uint8_t>& is_thin) const {
  struct Found {
    Cell cell;
    std::uint32_t object;
  };
  std::vector<Found> found;
  std::vector<int> cells(is_thin.size()), thin(is_thin.size());
  for (int row = 0; row < grid_.rows; ++row)
    for (int column = 0; column < grid_.columns; ++column)
      for (const RangeReturn& r : of(column, row)) {
        ++cells[r.object];
        if (r.rays == rays_around) continue;
        int met = 0, of_all = 0;
        for_each_neighbour({column, row}, [&](Cell n) {
          of_all += rays_around;
          for (const RangeReturn& other : of(n.column, n.row)) met += other.object == r.object ? other.rays : 0;
        });
        if (met >= thin_share * of_all) continue;
        ++thin[r.object];
        found.push_back({{column, row}, r.object});
      }
  for (std::size_t o = 0; o < is_thin.size(); ++o) is_thin[o] = 2 * thin[o] > cells[o];
  std::vector<Cell> all;
  for (const Found& f : found)
    if (is_thin[f.object] && (all.empty() || all.back() != f.cell)) all.push_back(f.cell);
  std::vector<std::uint8_t> is_listed(rows_.size() * static_cast<std::size_t>(grid_.columns));
  for (const Cell& cell : all) is_listed[index(cell)] = 1;
  const std::size_t most = std::min(all.size() + most_aimed_cells, most_thin_cells / 2);
  for (std::size_t o = 0, aimed_at = 0; o < is_thin.size() && aimed_at < most_aimed_at && all.size() < most; ++o)
    if (cells[o] == 0) is_thin[o] = 1, aimed_at += aim_at(static_cast<std::uint32_t>(o), is_listed, all);
  return all;
}

template <class F>
void RangeReturns::for_each_hit(Cell cell, Lattice lattice, F f) const {
  for (int ray = 0; ray < lattice.across * lattice.up; ray += RayPacket::size) {  // the rays fill whole packets
    RayPacket p{};
    aim_around(cell.column, cell.row, lattice, ray, RayPacket::size, p, 0);
    scene_.trace(p, 0xFFFFu, true);
    for (int lane = 0; lane < RayPacket::size; ++lane)
      if (p.object[lane] != RayPacket::miss) f(p, lane);
  }
}

/// Follows thin objects from the cells in which rays hit them to cells in which they lie between rays.
std::vector<RangeReturns::Cell> RangeReturns::crossed_cells(Parallel& pool) const {
  std::vector<std::uint8_t> is_thin(scene_.scene().objects.size());
  std::vector<Cell> edge = thin_cells(is_thin), crossed = edge;
  std::vector<std::uint8_t> is_known(rows_.size() * static_cast<std::size_t>(grid_.columns));
  for (const Cell& cell : edge) is_known[index(cell)] = 1;
  std::size_t probed = 0;
  while (!edge.empty() && crossed.size() <= most_thin_cells) {
    std::vector<Cell> beside;
    for (const Cell& cell : edge)
      for_each_neighbour(cell, [&](Cell n) {
        if (!std::exchange(is_known[index(n)], std::uint8_t{1})) beside.push_back(n);
      });
    probed += beside.size();
    if (probed > most_probed_cells) break;
    std::vector<std::uint8_t> is_crossed(beside.size());
    pool.for_each(beside.size(), [&](std::size_t n, int) {
      int met = 0;
      for_each_hit(beside[n], {probe_across, probe_across},
                   [&](const RayPacket& p, int lane) { met += is_thin[p.object[lane]]; });
      is_crossed[n] = met > 0 && met < probe_across * probe_across;
    });
    edge.clear();
    for (std::size_t n = 0; n < beside.size(); ++n)
      if (is_crossed[n]) edge.push_back(beside[n]);
    crossed.insert(crossed.end(), edge.begin(), edge.end());
  }
  return crossed;
}

/// Traces again, with many rays, the cells that thin objects cross.
void RangeReturns::look_closer(Parallel& pool) {
  const std::vector<Cell> cells = crossed_cells(pool);
  if (cells.empty() || cells.size() > most_thin_cells) return;
  const double for_each = std::sqrt(static_cast<double>(most_close_rays) / static_cast<double>(cells.size()));
  const int across = std::clamp(static_cast<int>(for_each) / 4 * 4, 8, most_across);  // rays fill whole packets
  std::vector<std::vector<RangeReturn>> seen(cells.size());
  pool.for_each(cells.size(), [&](std::size_t n, int) {
    for_each_hit(cells[n], {across, across}, [&](const RayPacket& p, int lane) {
      add(return_of(p, lane, {across, across}), p, lane, seen[n], 0);
    });
  });
  std::vector<std::size_t> which(rows_.size() * static_cast<std::size_t>(grid_.columns), cells.size());
  for (std::size_t n = 0; n < cells.size(); ++n) which[index(cells[n])] = n;
  for (int row = 0; row < grid_.rows; ++row) {
    if (std::none_of(cells.begin(), cells.end(), [row](const Cell& cell) { return cell.row == row; })) continue;
    Row renewed;
    for (int column = 0; column < grid_.columns; ++column) {
      renewed.begin.push_back(renewed.returns.size());
      const std::size_t n = which[index({column, row})];
      const std::span<const RangeReturn> now = n < cells.size() ? std::span<const RangeReturn>(seen[n]) : of(column, row);
      renewed.returns.insert(renewed.returns.end(), now.begin(), now.end());
    }
    renewed.begin.push_back(renewed.returns.size());
    rows_[static_cast<std::size_t>(row)] = std::move(renewed);
  }
}

}  // namespace sonar
