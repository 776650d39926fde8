#include "core/pipeline/specular/specular_extent.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/pipeline/arithmetic/fresnel.hpp"

namespace sonar {
namespace {

using Complex = std::complex<double>;
constexpr double window_in_units = 5.7;  // four Fresnel radii; beyond it only edges contribute, and they contribute little
constexpr double window_in_radii = 0.5;
constexpr int strips_per_cell = 4;

/// One principal direction: the integral of exp(-i pi (q x)^2 / 2), which is 1 over all x. Beyond a focus the conjugate is
/// integrated, which gives i over all x.
struct Direction {
  double q = 1;
  bool focused = false;
  /// F(q x) / (1 - i), F = C + iS (conjugate F before a focus). K_i of docs/acoustics.md, eq. 19, is the difference of two such
  /// values.
  Complex upto(double x) const {
    const FresnelPair f = fresnel(q * x);
    return Complex(f.c, focused ? f.s : -f.s) / Complex(1, -1);
  }
  Complex part(double from, double to) const { return to > from ? upto(to) - upto(from) : Complex{}; }
};

Direction direction_of(const SpecularPoint& p, std::size_t k, double wavelength_m) {
  // q of (19) [1/m]; 1 + r / R is negative behind a focus.
  return {1 / fresnel_unit_m(wavelength_m, p.range_m, p.curvature[k]), bending(p.range_m, p.curvature[k]) < 0};
}

/// Finds pairs of positions at which the surface begins and ends along a line of constant y.
void crossings(const SpecularPoint& p, double y, std::vector<double>& x) {
  x.clear();
  if (p.outline.empty()) {
    x = {p.from[0], p.to[0]};
    return;
  }
  for (const OutlineEdge& e : p.outline)
    // Even-odd rule: sorted crossings form pairs, which are the intervals inside the outline.
    if ((e.y0 > y) != (e.y1 > y)) x.push_back(e.x0 + (y - e.y0) / (e.y1 - e.y0) * (e.x1 - e.x0));
  std::sort(x.begin(), x.end());
}

/// The integral along one strip without the hidden cells of its row.
Complex along_strip(const Direction& d, const std::vector<double>& x, const SpecularWindow& w, std::size_t row) {
  Complex sum;
  const bool some_hidden = w.hidden.any();
  for (std::size_t i = 0; i + 1 < x.size(); i += 2) {
    if (!some_hidden) {
      sum += d.part(x[i], x[i + 1]);
      continue;
    }
    for (std::size_t c = 0; c < SpecularWindow::cells; ++c) {
      if (w.hidden[row * SpecularWindow::cells + c]) continue;
      const double low = c == 0 ? x[i] : std::max(x[i], w.edge[0][c]);
      const double high = c + 1 == SpecularWindow::cells ? x[i + 1] : std::min(x[i + 1], w.edge[0][c + 1]);
      sum += d.part(low, high);
    }
  }
  return sum;
}

}  // namespace

SpecularWindow make_window(const SpecularPoint& p, double wavelength_m) {
  SpecularWindow w;
  for (std::size_t k = 0; k < 2; ++k) {
    // The window has four Fresnel radii around the foot, or around the nearest point of the surface.
    double reach = window_in_units * fresnel_unit_m(wavelength_m, p.range_m, p.curvature[k]);
    // Beyond half a radius of curvature [m] the surface is not a parabola, as (19) assumes.
    if (p.curvature[k] != 0) reach = std::min(reach, window_in_radii / std::abs(p.curvature[k]));
    const double middle = std::clamp(0.0, p.from[k], p.to[k]);
    const double from = std::max(p.from[k], middle - reach), to = std::min(p.to[k], middle + reach);
    for (std::size_t c = 0; c <= SpecularWindow::cells; ++c)
      w.edge[k][c] = from + (to - from) * static_cast<double>(c) / SpecularWindow::cells;
  }
  return w;
}

Complex specular_factor(const SpecularPoint& p, double wavelength_m) {
  if (!p.outline.empty()) return specular_factor(p, wavelength_m, make_window(p, wavelength_m));
  return direction_of(p, 0, wavelength_m).part(p.from[0], p.to[0]) * direction_of(p, 1, wavelength_m).part(p.from[1], p.to[1]);
}

Complex specular_factor(const SpecularPoint& p, double wavelength_m, const SpecularWindow& w) {
  const Direction across = direction_of(p, 0, wavelength_m), up = direction_of(p, 1, wavelength_m);
  std::vector<double> x;
  Complex sum;
  // K_1 K_2 as a sum over strips. Each term is the integral over y of one strip times the integral over its intervals in x.
  const auto strip = [&](double from, double to, std::size_t row) {
    if (!(to > from)) return;
    // An infinite strip has no middle. Therefore its extent is the extent at the foot.
    const double middle = std::isinf(from) || std::isinf(to) ? 0 : 0.5 * (from + to);
    crossings(p, middle, x);
    sum += up.part(from, to) * along_strip(across, x, w, row);
  };
  const auto& edge = w.edge[1];
  // Adds the part below the window, the rows of cells of the window in four strips each, and the part above the window.
  strip(p.from[1], edge.front(), 0);
  for (std::size_t row = 0; row < SpecularWindow::cells; ++row)
    for (int s = 0; s < strips_per_cell; ++s) {
      const double step = (edge[row + 1] - edge[row]) / strips_per_cell;
      strip(edge[row] + s * step, edge[row] + (s + 1) * step, row);
    }
  strip(edge.back(), p.to[1], SpecularWindow::cells - 1);
  return sum;
}

bool on_surface(const SpecularPoint& p, double x, double y) {
  if (p.outline.empty()) return x >= p.from[0] && x <= p.to[0] && y >= p.from[1] && y <= p.to[1];
  std::vector<double> edges;
  crossings(p, y, edges);
  for (std::size_t i = 0; i + 1 < edges.size(); i += 2)
    if (x >= edges[i] && x <= edges[i + 1]) return true;
  return false;
}

std::array<double, 2> nearest_on_surface(const SpecularPoint& p) {
  if (p.outline.empty()) return {std::clamp(0.0, p.from[0], p.to[0]), std::clamp(0.0, p.from[1], p.to[1])};
  if (on_surface(p, 0, 0)) return {0, 0};
  std::array<double, 2> best{};
  double nearest = HUGE_VAL;
  for (const OutlineEdge& e : p.outline) {
    const double dx = e.x1 - e.x0, dy = e.y1 - e.y0;
    // Foot of the perpendicular on an edge.
    // 1e-30 m^2: an edge without length is treated as a point.
    const double t = std::clamp(-(e.x0 * dx + e.y0 * dy) / std::max(dx * dx + dy * dy, 1e-30), 0.0, 1.0);
    const std::array<double, 2> at{e.x0 + t * dx, e.y0 + t * dy};
    if (const double l = std::hypot(at[0], at[1]); l < nearest) nearest = l, best = at;
  }
  return best;
}

}  // namespace sonar
