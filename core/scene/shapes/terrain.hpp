// Ground as a height over a rectangular grid: read from files (PNG, ESRI ASCII, XYZ, GeoTIFF) or made from a seed.
// All become meshes about their own middle, so that far coordinates stay in the double precision of a pose.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/base/geodesy.hpp"
#include "core/base/result.hpp"
#include "core/base/utm.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

inline constexpr std::size_t max_mesh_triangles = 20'000'000;

/// Heights over the product of two rising coordinate lists; NaN = no ground there.
struct HeightGrid {
  std::vector<double> x, y;  // rising, at least two each; metres, or with an origin but no zone degrees of longitude and latitude
  std::vector<float> z_m;    // [y][x]
  /// Set: the ground lies in the plane that touches the ellipsoid here. A height stays what it is, above a flat sea.
  std::optional<Geodetic> origin = {};
  std::optional<UtmZone> zone = {};     // only with an origin: x and y are metres of this zone
  std::vector<std::string> notes = {};  // what the reader did that the scene's author should know
};

/// A mesh about its own middle, and where that middle lies in the coordinates it was described in.
struct CentredMesh {
  Mesh mesh;
  Vec3d centre_m;
  std::size_t left_out = 0;  // triangles without area
};

/// Fails when no four neighbouring heights exist, or when it would exceed max_mesh_triangles.
Result<CentredMesh> mesh_from_grid(const HeightGrid& grid);

/// Grey PNG of 8 or 16 bits, also stored as colours, over size_x by size_y metres about the origin; first row of the image =
/// largest y. Black is low_m, white is high_m.
Result<HeightGrid> read_png_heights(const std::filesystem::path& file, double size_x_m, double size_y_m, double low_m,
                                    double high_m);

/// How a file of heights with coordinates of its own is read.
struct HeightOptions {
  double z_scale = 1;                   // -1 for depths
  std::optional<bool> geographic = {};  // coordinates in degrees; unset: as the file says or shows
  std::optional<UtmZone> utm = {};      // zone of coordinates in metres; unset: as the file says, unless `geographic` is set
  std::optional<Geodetic> origin = {};  // origin of a grid in degrees or UTM
  /// Used if `origin` is unset. Without both, degrees are about the middle of the grid, and UTM stays as it is.
  std::optional<Geodetic> world_origin = {};
  bool centred = false;  // the caller puts the middle of the grid elsewhere, so its place does not matter
};
/// ESRI ASCII grid (.asc).
Result<HeightGrid> read_esri_heights(const std::filesystem::path& file, const HeightOptions& options);
/// Lines "x y z" of an even grid (.xyz).
Result<HeightGrid> read_xyz_heights(const std::filesystem::path& file, const HeightOptions& options);
/// GeoTIFF (.tif): one band of numbers, not turned. Unavailable where sonard was built without libtiff.
Result<HeightGrid> read_geo_tiff_heights(const std::filesystem::path& file, const HeightOptions& options);

struct Ripples {
  double wavelength_m = 0;   // 0 = none
  double height_m = 0;       // crest to trough
  double direction_rad = 0;  // the way the crests follow each other, from x towards y
  double bend = 0.35;        // how far the crest lines wander, in wavelengths
};
/// Made ground. Waves and bumps that the grid cannot carry fade out where it is coarse.
struct SeabedShape {
  double size_x_m = 40, size_y_m = 40;
  double fine_x_m = 40, fine_y_m = 40;  // inside, the grid has its spacing; outside it widens, up to 1 m
  double spacing_x_m = 0.2, spacing_y_m = 0.2;
  std::uint32_t seed = 1;
  double relief_m = 0.1;    // amplitude of the longest octave
  double wavelength_m = 4;  // wavelength of the longest octave
  int octaves = 5;
  double persistence = 0.5;  // amplitude ratio of one octave to the one before
  Ripples ripples = {};
  std::array<double, 2> slope{0, 0};  // rise per metre along x and y
};
/// Triangles the shape will have; the caller bounds it before making anything.
std::size_t seabed_triangles(const SeabedShape& shape);
HeightGrid make_seabed(const SeabedShape& shape);

}  // namespace sonar
