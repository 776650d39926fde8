#include "core/scene/shapes/terrain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/text/format.hpp"

namespace sonar {
namespace {

/// Computes east and north of every vertex of a grid. Coordinates in degrees or UTM give a point of the ellipsoid. This point
/// is projected into the plane that touches the ellipsoid at the origin; heights do not change. At a distance d from the
/// origin, lengths along the ground become shorter by the fraction (d / R)^2 / 2.
class PlaneOf {
 public:
  explicit PlaneOf(const HeightGrid& grid) : grid_(grid) {
    if (!grid.origin) return;
    const Geodetic& o = *grid.origin;
    sin_latitude_ = std::sin(o.latitude_rad), cos_latitude_ = std::cos(o.latitude_rad);
    at_origin_ = ring_at(o.latitude_rad);
    if (grid.zone) return;
    for (const double longitude_deg : grid.x) {
      const double turn = rad_from_deg(longitude_deg) - o.longitude_rad;
      sin_.push_back(std::sin(turn)), cos_.push_back(std::cos(turn));
    }
    for (const double latitude_deg : grid.y) rings_.push_back(ring_at(rad_from_deg(latitude_deg)));
  }
  Vec3d operator()(std::size_t i, std::size_t j, double z_m) const {
    if (!grid_.origin) return {grid_.x[i], grid_.y[j], z_m};
    if (!grid_.zone) return at(rings_[j], sin_[i], cos_[i], z_m);
    const Geodetic place = geodetic_from_utm(*grid_.zone, grid_.x[i], grid_.y[j]);
    const double turn = place.longitude_rad - grid_.origin->longitude_rad;
    return at(ring_at(place.latitude_rad), std::sin(turn), std::cos(turn), z_m);
  }

 private:
  struct Ring {
    double radius_m, z_m;  // distance from the earth's axis, and position along it
  };
  static Ring ring_at(double latitude_rad) {
    const Vec3d p = ecef_from({latitude_rad, 0, 0});
    return {p.x, p.z};
  }
  Vec3d at(const Ring& ring, double sin_turn, double cos_turn, double z_m) const {
    const double north_m = sin_latitude_ * at_origin_.radius_m + cos_latitude_ * (ring.z_m - at_origin_.z_m);
    return {ring.radius_m * sin_turn, north_m - sin_latitude_ * ring.radius_m * cos_turn, z_m};
  }

  const HeightGrid& grid_;
  std::vector<double> sin_, cos_;
  std::vector<Ring> rings_;
  Ring at_origin_{};
  double sin_latitude_ = 0, cos_latitude_ = 0;
};

}  // namespace

Result<CentredMesh> mesh_from_grid(const HeightGrid& grid) {
  const std::size_t columns = grid.x.size(), rows = grid.y.size();
  if (columns < 2 || rows < 2) return failure(ErrorKind::bad_data, "a height grid needs at least 2 x 2 heights");
  if (2 * (columns - 1) * (rows - 1) > max_mesh_triangles) {
    return failure(ErrorKind::bad_data, "the grid of " + std::to_string(columns) + " x " + std::to_string(rows) +
                                            " heights makes more than 20 million triangles; use a coarser one");
  }
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const float z : grid.z_m) {
    if (std::isnan(z)) continue;
    low = std::min(low, static_cast<double>(z));
    high = std::max(high, static_cast<double>(z));
  }
  if (low > high)
    return failure(ErrorKind::bad_data, "no cell of the grid has a height; check the value that the file declares as no data");
  CentredMesh out;
  const PlaneOf place(grid);
  out.centre_m = 0.5 * (place(0, 0, low) + place(columns - 1, rows - 1, high));
  constexpr std::uint32_t none = 0xFFFFFFFFu;
  std::vector<std::uint32_t> index(grid.z_m.size(), none);
  out.mesh.vertices.reserve(grid.z_m.size());
  for (std::size_t j = 0, k = 0; j < rows; ++j) {
    for (std::size_t i = 0; i < columns; ++i, ++k) {
      if (std::isnan(grid.z_m[k])) continue;
      index[k] = static_cast<std::uint32_t>(out.mesh.vertices.size());
      out.mesh.vertices.push_back(to_float(place(i, j, static_cast<double>(grid.z_m[k])) - out.centre_m));
    }
  }
  out.mesh.triangles.reserve(2 * (columns - 1) * (rows - 1));
  for (std::size_t j = 0; j + 1 < rows; ++j) {
    for (std::size_t i = 0; i + 1 < columns; ++i) {
      const std::size_t k = j * columns + i;
      const std::uint32_t a = index[k], b = index[k + 1], c = index[k + 1 + columns], d = index[k + columns];
      if (a == none || b == none || c == none || d == none) continue;
      if ((i + j) % 2 == 0) {  // diagonals alternate, so that slopes have no preferred side
        out.mesh.triangles.push_back({a, b, c});
        out.mesh.triangles.push_back({a, c, d});
      } else {
        out.mesh.triangles.push_back({a, b, d});
        out.mesh.triangles.push_back({b, c, d});
      }
    }
  }
  if (out.mesh.triangles.empty()) return failure(ErrorKind::bad_data, "no four neighbouring cells of the grid have heights");
  out.mesh.material.assign(out.mesh.triangles.size(), 0);
  return out;
}

namespace {

double fade(double t) { return t * t * t * (t * (6 * t - 15) + 10); }  // second derivative zero at both ends
double mix(double a, double b, double t) { return a + t * (b - a); }

double lattice_value(std::int64_t x, std::int64_t y, std::int64_t z, std::uint32_t seed, std::uint32_t stream) {
  const Random4 r = philox(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), static_cast<std::uint32_t>(z), 0, seed,
                           stream ^ static_cast<std::uint32_t>(Domain::relief_value));
  return 2.0 * static_cast<double>(uniform_open(r.v[0])) - 1;
}

}  // namespace

double value_noise(Vec3d p, std::uint32_t seed, std::uint32_t stream) {
  const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
  const auto x = static_cast<std::int64_t>(fx), y = static_cast<std::int64_t>(fy), z = static_cast<std::int64_t>(fz);
  const double tx = fade(p.x - fx), ty = fade(p.y - fy), tz = fade(p.z - fz);
  double face[2];
  for (int k = 0; k < 2; ++k) {
    const double low = mix(lattice_value(x, y, z + k, seed, stream), lattice_value(x + 1, y, z + k, seed, stream), tx);
    const double high = mix(lattice_value(x, y + 1, z + k, seed, stream), lattice_value(x + 1, y + 1, z + k, seed, stream), tx);
    face[k] = mix(low, high, ty);
  }
  return mix(face[0], face[1], tz);
}

GradientField::GradientField(double half_x_m, double half_y_m, double wavelength_m, std::uint32_t seed, std::uint32_t stream)
    : wavelength_m_(wavelength_m) {
  const auto reach = [&](double half) { return static_cast<int>(std::ceil(half / wavelength_m)) + 1; };
  first_x_ = -reach(half_x_m);
  first_y_ = -reach(half_y_m);
  columns_ = -2 * first_x_ + 1;
  rows_ = -2 * first_y_ + 1;
  slopes_.reserve(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  for (int y = first_y_; y < first_y_ + rows_; ++y) {
    for (int x = first_x_; x < first_x_ + columns_; ++x) {
      const Random4 r = philox(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), stream, 1, seed,
                               static_cast<std::uint32_t>(Domain::relief_gradient));
      const double a = 2 * pi * static_cast<double>(uniform_open(r.v[0]));
      slopes_.push_back({static_cast<float>(std::cos(a)), static_cast<float>(std::sin(a))});
    }
  }
}

double GradientField::operator()(double x_m, double y_m) const {
  const double x = x_m / wavelength_m_ - first_x_, y = y_m / wavelength_m_ - first_y_;
  const int i = std::clamp(static_cast<int>(x), 0, columns_ - 2), j = std::clamp(static_cast<int>(y), 0, rows_ - 2);
  const double u = x - i, v = y - j;
  const auto corner = [&](int di, int dj) {
    const Slope s =
        slopes_[static_cast<std::size_t>(j + dj) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(i + di)];
    return static_cast<double>(s.x) * (u - di) + static_cast<double>(s.y) * (v - dj);
  };
  const double low = mix(corner(0, 0), corner(1, 0), fade(u)), high = mix(corner(0, 1), corner(1, 1), fade(u));
  return std::sqrt(2.0) * mix(low, high, fade(v));
}

// Generated ground: octaves of gradient noise, and sand ripples with bent crests that do not fork. The spacing of the grid
// grows outwards.

namespace {

constexpr double widening = 1.08, widest_m = 1.0;
constexpr double noted_share = 0.25;  // ripples that keep less than this fraction of their height are noted

struct Axis {
  std::vector<double> at_m, spacing_m;
};

int fine_steps(double fine_half_m, double spacing_m) {
  return static_cast<int>(std::clamp(std::ceil(fine_half_m / spacing_m - 1e-9), 1.0, 1e9));
}
// Calls each(distance) for rows outside the fine part, between `from_m` and `half_m`.
void widen(double from_m, double half_m, double spacing_m, auto&& each) {
  double step = spacing_m;
  while (from_m < half_m - 1e-9) {
    step = std::max(spacing_m, std::min(step * widening, widest_m));
    from_m = from_m + 1.5 * step > half_m ? half_m : from_m + step;
    each(from_m);
  }
}

Axis make_axis(double size_m, double fine_m, double spacing_m) {
  const double half = size_m / 2, fine_half = std::min(fine_m / 2, half);
  const int n = fine_steps(fine_half, spacing_m);
  std::vector<double> outwards;  // distances from the middle, without zero
  for (int i = 1; i <= n; ++i) outwards.push_back(fine_half * i / n);
  widen(fine_half, half, spacing_m, [&](double at) { outwards.push_back(at); });
  Axis axis;
  for (std::size_t i = outwards.size(); i-- > 0;) axis.at_m.push_back(-outwards[i]);
  axis.at_m.push_back(0);
  axis.at_m.insert(axis.at_m.end(), outwards.begin(), outwards.end());
  for (std::size_t i = 0; i < axis.at_m.size(); ++i) {
    const std::size_t last = axis.at_m.size() - 1;
    axis.spacing_m.push_back(std::max(axis.at_m[std::min(i + 1, last)] - axis.at_m[i], axis.at_m[i] - axis.at_m[i ? i - 1 : 0]));
  }
  return axis;
}

// Weight of a wave: 1 with at least six grid points per wavelength, 0 with three or fewer.
double carried(double wavelength_m, double spacing_m) { return std::clamp(wavelength_m / spacing_m / 3 - 1, 0.0, 1.0); }

// Profile of a ripple, -0.39..0.5: rounded troughs, sharper crests, mean zero to a few per cent.
double ripple_profile(double cycles) {
  const double c = std::cos(2 * pi * cycles);
  return 0.5 * (c + 0.25 * (c * c - 0.5)) / 1.125;
}

/// Returns a note if even the finest part of the grid shows less than noted_share of the ripples' height.
std::vector<std::string> notes_on(const Ripples& r, double spacing_m) {
  const double share = carried(r.wavelength_m, spacing_m);
  if (share >= noted_share) return {};
  const std::string has = share < 0.005 ? "do not appear" : text::format("keep at most %.0f %% of their height", 100 * share);
  return {text::format("its ripples of wavelength %g m ", r.wavelength_m) + has +
          text::format(": the finest spacing of its grid is %.3g m; set spacing_m: %.3g, and fine_size_m if the bed is large",
                       spacing_m, r.wavelength_m / 6)};
}

}  // namespace

std::size_t seabed_triangles(const SeabedShape& s) {
  const auto cells = [](double size, double fine, double spacing) {
    const double half = size / 2, fine_half = std::min(fine / 2, half);
    double n = fine_steps(fine_half, spacing);
    widen(fine_half, half, spacing, [&](double) { ++n; });
    return 2 * n;
  };
  const double count = 2 * cells(s.size_x_m, s.fine_x_m, s.spacing_x_m) * cells(s.size_y_m, s.fine_y_m, s.spacing_y_m);
  return static_cast<std::size_t>(std::min(count, 1e15));
}

HeightGrid make_seabed(const SeabedShape& s) {
  const Axis x = make_axis(s.size_x_m, s.fine_x_m, s.spacing_x_m), y = make_axis(s.size_y_m, s.fine_y_m, s.spacing_y_m);
  HeightGrid grid{.x = x.at_m, .y = y.at_m, .z_m = std::vector<float>(x.at_m.size() * y.at_m.size())};
  std::vector<double> z(grid.z_m.size());
  const auto each = [&](auto&& body) {
    for (std::size_t j = 0, k = 0; j < y.at_m.size(); ++j) {
      for (std::size_t i = 0; i < x.at_m.size(); ++i, ++k) body(k, i, j);
    }
  };
  each([&](std::size_t k, std::size_t i, std::size_t j) { z[k] = s.slope[0] * x.at_m[i] + s.slope[1] * y.at_m[j]; });
  double amplitude = s.relief_m, wavelength = s.wavelength_m;
  for (int octave = 0; octave < s.octaves; ++octave, amplitude *= s.persistence, wavelength /= 2) {
    if (amplitude < 1e-5 || wavelength < 3 * std::min(s.spacing_x_m, s.spacing_y_m)) break;
    const GradientField field(s.size_x_m / 2, s.size_y_m / 2, wavelength, s.seed, static_cast<std::uint32_t>(octave));
    each([&](std::size_t k, std::size_t i, std::size_t j) {
      const double w = carried(wavelength, std::max(x.spacing_m[i], y.spacing_m[j]));
      if (w > 0) z[k] += w * amplitude * field(x.at_m[i], y.at_m[j]);
    });
  }
  if (const Ripples& r = s.ripples; r.wavelength_m > 0 && r.height_m > 0) {
    const GradientField bend(s.size_x_m / 2, s.size_y_m / 2, 8 * r.wavelength_m, s.seed, 1001);
    const GradientField strength(s.size_x_m / 2, s.size_y_m / 2, 15 * r.wavelength_m, s.seed, 1002);
    const double cx = std::cos(r.direction_rad), cy = std::sin(r.direction_rad);
    const auto finest = [](const Axis& axis) { return *std::min_element(axis.spacing_m.begin(), axis.spacing_m.end()); };
    grid.notes = notes_on(r, std::hypot(cx * finest(x), cy * finest(y)));
    each([&](std::size_t k, std::size_t i, std::size_t j) {
      const double spacing = std::hypot(cx * x.spacing_m[i], cy * y.spacing_m[j]);
      const double w = carried(r.wavelength_m, spacing);
      if (w <= 0) return;
      const double px = x.at_m[i], py = y.at_m[j];
      const double cycles = (cx * px + cy * py) / r.wavelength_m + r.bend * bend(px, py);
      z[k] += w * r.height_m * std::clamp(0.8 + 0.5 * strength(px, py), 0.2, 1.0) * ripple_profile(cycles);
    });
  }
  std::transform(z.begin(), z.end(), grid.z_m.begin(), [](double v) { return static_cast<float>(v); });
  return grid;
}

}  // namespace sonar
