// The vector loops that build cells. Every lane does the same correctly rounded operations in the same order, so the bytes do
// not depend on the instruction set. The points of a tile are stored in blocks of 4 x 4, and in rows within a block.
#pragma once

#include <cstdint>

namespace sonar::cell_lanes {

constexpr int side = 16, points = side * side;  // points along a side of a tile; points of a tile
constexpr int block = 16, blocks = points / block;

/// Inputs of the random draws of a tile, besides the indices of the cells along u and v.
struct DrawKey {
  std::uint32_t patch, level, lo, hi;
};

/// A tile's lattice points: positions in the lattice plane [m], and the random draws of their speckle.
struct Points {
  alignas(64) double u[points], v[points];
  alignas(64) std::uint32_t speckle_a[points], speckle_b[points];
};
/// Makes the points of a tile. first_i, first_j: lattice indices of the tile's first cell.
void draw_points(const DrawKey& key, std::int32_t first_i, std::int32_t first_j, double cell_size_m, Points& to);

/// A facet, prepared for tests with the points of one cube. It owns a point that lies in the open box, on the inner side of the
/// three edges (du (v - pv) - dv (u - pu) >= `least`), and at a height in [low_w, end_w).
struct FacetTest {
  struct Edge {
    double pu, pv, du, dv, least;
  };
  Edge edge[3];
  double low_u, end_u, low_v, end_v, low_w, end_w;
  double u0, v0, w0, nu, nv, nw;  // plane: one corner and the unit normal
};
/// The facet that owns each point of a tile, and the point's height [m].
struct Owners {
  alignas(64) std::int64_t facet[points];  // -1: no owner
  alignas(64) double w[points];
};
/// The points of a block that a facet owns, as bit masks, and their heights.
struct BlockHeights {
  alignas(64) double w[block];
  alignas(64) std::int64_t owned[block];  // all bits or none
};
/// Makes a facet the owner of its points in one block. If one of them already has an owner (another surface at the same height,
/// or a surface that folds back), the function stores the result in `found`, changes nothing else and returns false.
bool own_block(const FacetTest& test, const Points& in, int which, std::int64_t facet, Owners& owners, BlockHeights& found);

/// Quadratic B-splines of a field (TextureField) at the cells of a block: on each axis the first of three lattice points about
/// the cell, and their weights, whose squares add to one.
struct Splines {
  alignas(64) std::int32_t first[3][block];
  alignas(64) float weight[3][3][block];
};
/// Computes the splines of a block. per_m: lattice points per metre. Returns true if all cells have the same lattice points.
bool find_splines(const double* const (&place_m)[3], double per_m, Splines& to);

/// A function of a standard normal variable: values at equal steps from -widest to widest, and the last value again.
struct NormalTable {
  const float* values;
  float widest, per_normal, last;  // per_normal: steps per unit; last: number of steps
};
/// Multiplies `root` of each cell of a block by the table's value at the cell's normal variable. This variable is the weighted
/// sum of those of its 27 lattice points (x changes fastest).
void multiply_by_field(const Splines& splines, const float (&normals)[27][block], const NormalTable& table, double* root);

/// Makes circular complex Gaussians with E|z|^2 = 1 from pairs of draws (Box-Muller, as complex_normal), multiplied by `root`.
/// The error is about 2e-7 of their magnitude. n must be a multiple of `block`. Returns the largest |re| or |im|.
float speckle(const std::uint32_t* a, const std::uint32_t* b, const double* root, int n, float* re, float* im);

struct Extent {
  double low, high;
};
/// Stores (place - middle) / unit as integers, rounded half away from zero and clamped to +-32767. n must be a multiple of
/// `block`. Returns the least and largest place - middle.
Extent pack_places(const double* place, int n, double middle, double unit, std::int16_t* counts);
void pack_weights(const float* weight, int n, float unit, std::int16_t* counts);

}  // namespace sonar::cell_lanes
