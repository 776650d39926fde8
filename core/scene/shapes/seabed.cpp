// Generated ground: octaves of gradient noise, and sand ripples with bent crests that do not fork. The spacing of the grid
// grows outwards.
#include <algorithm>
#include <cmath>

#include "core/scene/shapes/terrain.hpp"
#include "core/text/format.hpp"

namespace sonar {
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

// Weight of a wave: 1 if it has at least six grid points, 0 if it has three or fewer.
double carried(double wavelength_m, double spacing_m) { return std::clamp(wavelength_m / spacing_m / 3 - 1, 0.0, 1.0); }

// Profile of a ripple, -0.5..0.5: rounded troughs, sharper crests, mean zero to a few per cent.
double ripple_profile(double cycles) {
  const double c = std::cos(2 * pi * cycles);
  return 0.5 * (c + 0.25 * (c * c - 0.5)) / 1.125;
}

/// A note if even the finest part of the grid shows less than noted_share of the ripples' height.
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
