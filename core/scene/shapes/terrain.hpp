// Ground as heights over a rectangular grid, read from files (PNG, ESRI ASCII, XYZ, GeoTIFF) or generated from a seed. Meshes
// are relative to their middle. The coordinates of this middle may be large and are stored in double precision.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/base/geodesy.hpp"
#include "core/base/geometry.hpp"
#include "core/base/random.hpp"
#include "core/base/result.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

inline constexpr std::size_t max_mesh_triangles = 20'000'000;

/// Heights over all pairs of two rising coordinate lists; NaN = no ground there.
struct HeightGrid {
  // Increasing, at least two each; metres, or degrees of longitude and latitude if an origin but no zone is set.
  std::vector<double> x, y;
  std::vector<float> z_m;  // [y][x]
  /// If set, x and y are converted to the plane that is tangent to the ellipsoid here. Heights do not change: the sea is
  /// treated as flat.
  std::optional<Geodetic> origin = {};
  std::optional<UtmZone> zone = {};     // only with an origin: x and y are metres of this zone
  std::vector<std::string> notes = {};  // sentences about decisions of the reader that the scene's author should know
};

/// A mesh relative to its middle, and the position of this middle in the original coordinates.
struct CentredMesh {
  Mesh mesh;
  Vec3d centre_m;
  std::size_t left_out = 0;  // triangles without area
};

/// Makes the mesh. Returns an error if no four neighbouring heights exist, or if the mesh would exceed max_mesh_triangles.
Result<CentredMesh> mesh_from_grid(const HeightGrid& grid);

/// Reads a grey PNG of at most 16 bits, which may be stored as colours. It covers size_x by size_y metres about the origin; the
/// first row of the image has the largest y. Black is low_m, white is high_m.
Result<HeightGrid> read_png_heights(const std::filesystem::path& file, double size_x_m, double size_y_m, double low_m,
                                    double high_m);

/// Options for files of heights that have coordinates.
struct HeightOptions {
  double z_scale = 1;                   // -1 for depths
  std::optional<bool> geographic = {};  // coordinates in degrees; unset: from the file
  std::optional<UtmZone> utm = {};      // zone of coordinates in metres; unset: from the file, unless `geographic` is set
  std::optional<Geodetic> origin = {};  // origin of a grid in degrees or UTM
  /// This is used if `origin` is unset. Without both, degrees are relative to the middle of the grid, and UTM coordinates are
  /// used unchanged.
  std::optional<Geodetic> world_origin = {};
  bool centred = false;  // the caller positions the middle of the grid; the coordinates of the file have no effect
};
/// Reads an ESRI ASCII grid (.asc).
Result<HeightGrid> read_esri_heights(const std::filesystem::path& file, const HeightOptions& options);
/// Reads lines "x y z" of a uniform grid (.xyz).
Result<HeightGrid> read_xyz_heights(const std::filesystem::path& file, const HeightOptions& options);
/// Reads a GeoTIFF (.tif): one band of numbers, not rotated. Error `unavailable` if sonard was built without libtiff.
Result<HeightGrid> read_geo_tiff_heights(const std::filesystem::path& file, const HeightOptions& options);

struct Ripples {
  double wavelength_m = 0;   // 0 = none
  double height_m = 0;       // crest to trough
  double direction_rad = 0;  // direction perpendicular to the crests, from x towards y
  double bend = 0.35;        // amplitude of the bends of crest lines, in wavelengths
};
/// Generated ground. Waves and bumps that are too short for the grid fade out where it is coarse.
struct SeabedShape {
  double size_x_m = 40, size_y_m = 40;
  double fine_x_m = 40, fine_y_m = 40;  // area in which the grid has its spacing; outside, the spacing grows up to 1 m
  double spacing_x_m = 0.2, spacing_y_m = 0.2;
  std::uint32_t seed = 1;
  double relief_m = 0.1;    // amplitude of the longest octave
  double wavelength_m = 4;  // wavelength of the longest octave
  int octaves = 5;
  double persistence = 0.5;  // amplitude ratio of successive octaves
  Ripples ripples = {};
  std::array<double, 2> slope{0, 0};  // rise per metre along x and y
};
/// Number of triangles of the shape, for a check before making the mesh.
std::size_t seabed_triangles(const SeabedShape& shape);
HeightGrid make_seabed(const SeabedShape& shape);

// Smooth random fields for generated terrain and boulders. They use Philox, so the same seed gives the same terrain on every
// machine. Only the loading of scenes uses them.

/// Smooth value noise on the unit lattice in space, in -1..1. Two fields with the same seed differ if their `stream` differs.
double value_noise(Vec3d p, std::uint32_t seed, std::uint32_t stream);

/// Gradient noise over a rectangle of the plane, about -1..1, with features of one wavelength. The constructor draws the
/// gradients of the lattice.
class GradientField {
 public:
  /// The field covers |x| <= half_x and |y| <= half_y [m].
  GradientField(double half_x_m, double half_y_m, double wavelength_m, std::uint32_t seed, std::uint32_t stream);
  double operator()(double x_m, double y_m) const;

 private:
  struct Slope {
    float x, y;
  };
  double wavelength_m_;
  int first_x_, first_y_, columns_, rows_;
  std::vector<Slope> slopes_;
};

}  // namespace sonar
