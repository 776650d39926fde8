// Patches of stronger and weaker scattering, fixed to a surface: a continuous Gamma field of mean 1 over object coordinates
// (docs/acoustics.md, section 3). build_tile multiplies the cells' speckle by its square root, so that echoes are K-distributed.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/random.hpp"
#include "core/base/units.hpp"
#include "core/scene/cells/cell_lanes.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

/// The field of one material: a smooth Gaussian field of unit variance, whose values are mapped to the Gamma distribution at
/// equal quantiles. The Gaussian field consists of normal draws on a cubic lattice of the correlation length, blended with
/// quadratic splines.
class TextureField {
 public:
  /// texture.shape must be > 0. texture.correlation_m is the distance at which the correlation has fallen to about 1 / e.
  TextureField(const Texture& texture, std::uint32_t texture_seed, Seed seed, Domain domain = Domain::texture);

  double lattice_m() const { return lattice_m_; }
  /// The standard normal draw of a lattice point. It depends only on (seed, texture seed, object, point).
  float normal_at(int object, std::int32_t i, std::int32_t j, std::int32_t k) const;
  /// The root of the Gamma variable (mean 1) at the quantiles of a standard normal.
  cell_lanes::NormalTable roots() const;

 private:
  double lattice_m_;
  RandomKey key_;
  std::vector<float> roots_;
};

/// Evaluates a field at the cells of one object. It caches the lattice points that neighbouring cells share. Therefore only one
/// thread may use it.
class TexturePatch {
 public:
  TexturePatch(const TextureField& field, int object);
  /// Multiplies amplitudes (`root`) by the square root of the field. place_m: x, y, z in object coordinates. n must be a multiple
  /// of cell_lanes::block.
  void multiply(std::array<const double*, 3> place_m, int n, double* root);
  /// The root of the field at one point.
  float root_at(Vec3d place_m);

 private:
  struct Point {
    std::int32_t i, j, k;
    float normal;
  };
  static constexpr std::size_t remembered_along = 16, remembered_up = 8,  // size of the cache of lattice points
      remembered = remembered_along * remembered_along * remembered_up;
  float normal_at(std::int32_t i, std::int32_t j, std::int32_t k);
  void load_points(std::int32_t i, std::int32_t j, std::int32_t k);

  const TextureField& field_;
  int object_;
  bool has_near_ = false;                              // true if near_ has been filled
  std::int32_t near_i_ = 0, near_j_ = 0, near_k_ = 0;  // the first of the points around the last position
  std::array<float, 27> near_{};                       // their normals; i changes fastest
  std::unique_ptr<Point[]> points_;                    // valid where is_known_
  std::bitset<remembered> is_known_;
};

}  // namespace sonar
