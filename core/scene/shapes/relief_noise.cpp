#include "core/scene/shapes/relief_noise.hpp"

#include <algorithm>

namespace sonar {
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

}  // namespace sonar
