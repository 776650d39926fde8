// The returns of a range image (core/pipeline/range_image.hpp). One ray is traced through the middle of each cell of the beam
// grid and of a few cells around the grid. Many rays are traced through cells with objects that are thinner than a cell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/parallel.hpp"
#include "core/base/random.hpp"
#include "core/pipeline/scattering_law.hpp"
#include "core/scene/ray_scene.hpp"
#include "core/sonar/range_image.hpp"

namespace sonar {

/// An echo that a beam receives from one direction, with uniform power over range_m -+ half_m, in metres of the device.
struct RangeReturn {
  double range_m = 0, half_m = 0, power = 0;  // power [uPa^2] in a beam in this direction; 0 = no echo
  ComplexNormal speckle{1, 0};
  std::uint32_t draw = 0;  // draw for the speckle of its range cells, see RangeReturns::speckle_in()
  std::uint32_t object = BeamTruth::nothing;
  // Power in the range cells `first` to `last`: of_first in the first cell, of_last in the last (if it is another cell),
  // of_each in the others.
  std::int32_t first = 0, last = 0;
  double of_first = 0, of_each = 0, of_last = 0;
  // Properties of the patch of surface: cosine of the incidence, spread of its ranges about range_m, number of the cell's rays
  // that hit it.
  double cosine = 0, spread_m = 0;
  int rays = 0;

  void share_among_cells(double cell_m);
  /// Power in a cell from `first` to `last`.
  double power_in(std::ptrdiff_t cell) const { return cell == first ? of_first : cell == last ? of_last : of_each; }
};

struct PointReturn : RangeReturn {
  double azimuth_rad = 0, elevation_rad = 0;
};

// Half of the longest range interval that the patch of one ray can have, at grazing incidence [m].
constexpr double longest_return_half_m = 0.5;

class RangeReturns {
 public:
  /// `cell_m`: width of a range cell. The bodies of `scene` must have been placed.
  RangeReturns(const RayScene& scene, const PingRequest& request, double cell_m);

  /// Traces all rays. The result does not depend on the number of threads.
  void trace(Parallel& pool);
  /// Returns of a cell of the grid; none before trace().
  std::span<const RangeReturn> of(int column, int row) const {
    const Row& of_row = rows_[static_cast<std::size_t>(row)];
    if (of_row.begin.empty()) return {};
    const std::size_t* begin = of_row.begin.data() + column;
    return {of_row.returns.data() + begin[0], begin[1] - begin[0]};
  }
  /// Returns of the point targets that are not hidden.
  std::vector<PointReturn> of_points() const;
  /// Speckle of a return in one range cell, for one block of rows. It is used for images in which each range cell has its own
  /// speckle.
  ComplexNormal speckle_in(const RangeReturn& r, std::ptrdiff_t cell, int block) const {
    const std::uint32_t of_cell = static_cast<std::uint32_t>(cell) * 389u + static_cast<std::uint32_t>(block) * 1543u;
    return draws_[(r.draw + of_cell) % static_cast<std::uint32_t>(draws_.size())];
  }
  double device_per_true() const { return device_per_true_; }  // factor from true ranges to ranges of the device

 private:
  struct Angle {
    double cosine, sine;
  };
  /// The returns of a row of the grid, cell by cell.
  struct Row {
    std::vector<RangeReturn> returns;
    std::vector<std::size_t> begin;  // first return of each column, and the end
  };
  struct Cell {
    int column = 0, row = 0;
    bool operator==(const Cell&) const = default;
  };
  // Number of rays around the middle of a cell. These rays show which part of the cell is covered by an object that the middle
  // ray misses.
  static constexpr int rays_across = 2, rays_up = 2, rays_around = rays_across * rays_up,
                       cells_a_packet = RayPacket::size / rays_around;
  /// Number of rays across a cell in azimuth and in elevation. The rays are uniform over the cell.
  struct Lattice {
    int across = 1, up = 1;
  };

  void trace(int row);
  void trace_middles(int row, std::vector<RangeReturn>& middles) const;
  void aim_around(int column, int row, Lattice lattice, int first_ray, int rays, RayPacket& p, int first_lane) const;
  void compare_around(RangeReturn& middle, const RayPacket& p, int first_lane, std::vector<RangeReturn>& to) const;
  void aim(RayPacket& p, int lane, Vec3 direction) const;
  RangeReturn return_of(const RayPacket& p, int lane, Lattice lattice) const;  // without speckle
  void draw_speckle(const RayPacket& p, int lane, RangeReturn& r) const;
  void add(const RangeReturn& r, const RayPacket& p, int lane, std::vector<RangeReturn>& to, std::size_t first) const;
  void look_closer(Parallel& pool);
  bool aim_at(std::uint32_t object, std::vector<std::uint8_t>& is_listed, std::vector<Cell>& cells) const;
  std::vector<Cell> thin_cells(std::vector<std::uint8_t>& is_thin) const;  // is_thin: by object
  std::vector<Cell> crossed_cells(Parallel& pool) const;
  Vec3d direction(int column, int row) const;  // direction of a beam in sonar axes
  std::size_t index(Cell cell) const {
    return static_cast<std::size_t>(cell.row) * static_cast<std::size_t>(grid_.columns) + static_cast<std::size_t>(cell.column);
  }
  template <class F>
  void for_each_neighbour(Cell cell, F f) const;
  template <class F>
  void for_each_hit(Cell cell, Lattice lattice, F f) const;  // f(packet, lane)

  const RayScene& scene_;
  const PingRequest& request_;
  RangeImageGrid grid_;
  double cell_m_;
  double column_step_rad_ = 0, row_step_rad_ = 0;  // steps between directions of beams, in the middle of the picture
  Rotation world_from_sonar_;
  Vec3 origin_;
  double device_per_true_ = 1, absorption_np_ = 0, source_ = 1;
  std::vector<LawTable> laws_;
  std::vector<Angle> azimuth_, elevation_;  // angles of the columns and rows
  std::vector<Row> rows_;
  std::vector<ComplexNormal> draws_;  // draws that speckle_in() returns
};

}  // namespace sonar
