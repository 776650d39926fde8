#include "core/scene/cells/texture.hpp"

#include <algorithm>
#include <cmath>

namespace sonar {
namespace {

constexpr int quantiles = 256;       // intervals of the table of quantiles
constexpr double widest_normal = 5;  // the table covers normals from -5 to 5
constexpr double weakest = 1e-4;     // -40 dB; a cell with a lower value could not be distinguished from an empty cell

struct IncompleteGamma {
  double lower, upper;
};
/// P(a, x) and Q(a, x) = 1 - P, regularised. For x below a + 1 a series is used, for larger x a continued fraction (Lentz).
IncompleteGamma incomplete_gamma(double a, double x, double log_gamma_a) {
  const double front = std::exp(a * std::log(x) - x - log_gamma_a);
  if (x < a + 1) {
    double term = 1 / a, sum = term;
    for (int n = 1; n < 500 && term > sum * 1e-14; ++n) sum += term *= x / (a + n);
    return {front * sum, 1 - front * sum};
  }
  constexpr double tiny = 1e-300;
  double b = x + 1 - a, c = 1 / tiny, d = 1 / b, h = d;
  for (int n = 1; n < 500; ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = an * d + b;
    d = 1 / (std::abs(d) < tiny ? tiny : d);
    c = b + an / c;
    if (std::abs(c) < tiny) c = tiny;
    const double step = d * c;
    h *= step;
    if (std::abs(step - 1) < 1e-14) break;
  }
  return {1 - front * h, front * h};
}

/// The Gamma variable of shape nu and mean 1 at the quantile of a standard normal.
double gamma_at_normal(double nu, double log_gamma_nu, double normal) {
  const double below = 0.5 * std::erfc(-normal / std::sqrt(2.0)), above = 0.5 * std::erfc(normal / std::sqrt(2.0));
  // Bisection in log x. After 48 halvings the error is far below the rounding error of the float results.
  double low = std::log(weakest * nu), high = std::log(nu + 40 * std::sqrt(nu) + 60);
  for (int i = 0; i < 48; ++i) {
    const double middle = 0.5 * (low + high);
    const IncompleteGamma at = incomplete_gamma(nu, std::exp(middle), log_gamma_nu);
    const bool too_small = normal < 0 ? at.lower < below : at.upper > above;
    (too_small ? low : high) = middle;
  }
  return std::exp(0.5 * (low + high)) / nu;
}

}  // namespace

TextureField::TextureField(const Texture& texture, std::uint32_t texture_seed, Seed seed, Domain domain)
    : lattice_m_(static_cast<double>(texture.correlation_m)), key_(key_of(seed, domain)) {
  key_.high ^= texture_seed;
  const double nu = static_cast<double>(texture.shape), log_gamma_nu = std::lgamma(nu);
  double mean = 0, weight = 0;
  std::vector<double> values;
  // x = P^-1(nu, Phi(z)) / nu at equally spaced z, divided by the mean over the normal density.
  for (int i = 0; i <= quantiles; ++i) {
    const double normal = widest_normal * (2.0 * i / quantiles - 1), density = std::exp(-0.5 * normal * normal);
    values.push_back(gamma_at_normal(nu, log_gamma_nu, normal));
    mean += density * values.back();
    weight += density;
  }
  for (const double v : values) roots_.push_back(static_cast<float>(std::sqrt(v * weight / mean)));
  roots_.push_back(roots_.back());
}

float TextureField::normal_at(int object, std::int32_t i, std::int32_t j, std::int32_t k) const {
  const Random4 draw = philox(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j), static_cast<std::uint32_t>(k),
                              key_.domain ^ static_cast<std::uint32_t>(object), key_.low, key_.high);
  return 1.41421356f * complex_normal(draw.v[0], draw.v[1]).re;
}

cell_lanes::NormalTable TextureField::roots() const {
  return {roots_.data(), static_cast<float>(widest_normal), static_cast<float>(quantiles / (2 * widest_normal)), quantiles};
}

TexturePatch::TexturePatch(const TextureField& field, int object)
    : field_(field), object_(object), points_(std::make_unique_for_overwrite<Point[]>(remembered)) {}

float TexturePatch::normal_at(std::int32_t i, std::int32_t j, std::int32_t k) {
  const auto slot = [](std::int32_t x, std::size_t size) { return static_cast<std::size_t>(x) & (size - 1); };
  const std::size_t at =
      (slot(k, remembered_up) * remembered_along + slot(j, remembered_along)) * remembered_along + slot(i, remembered_along);
  Point& p = points_[at];
  if (!is_known_[at] || p.i != i || p.j != j || p.k != k) p = {i, j, k, field_.normal_at(object_, i, j, k)};
  is_known_[at] = true;
  return p.normal;
}

/// Loads the 27 points around a position if they have changed. Neighbouring cells mostly have the same points.
void TexturePatch::load_points(std::int32_t i, std::int32_t j, std::int32_t k) {
  if (i == near_i_ && j == near_j_ && k == near_k_ && has_near_) return;
  near_i_ = i, near_j_ = j, near_k_ = k;
  has_near_ = true;
  float* to = near_.data();
  for (int up = 0; up < 3; ++up)
    for (int across = 0; across < 3; ++across)
      for (int along = 0; along < 3; ++along) *to++ = normal_at(i + along, j + across, k + up);
}

// The table is read at the weighted sum of 27 lattice normals. The squares of the weights add to 1, so this sum is again a
// standard normal.
void TexturePatch::multiply(std::array<const double*, 3> place_m, int n, double* root) {
  constexpr int block = cell_lanes::block;
  const double per_m = 1 / field_.lattice_m();
  const cell_lanes::NormalTable roots = field_.roots();
  cell_lanes::Splines splines;
  alignas(64) float normals[27][block];
  for (int at = 0; at < n; at += block) {
    const double* const here[3] = {place_m[0] + at, place_m[1] + at, place_m[2] + at};
    const int different = cell_lanes::find_splines(here, per_m, splines) ? 1 : block;
    const auto& [i, j, k] = splines.first;
    for (int l = 0; l < different; ++l) {
      load_points(i[l], j[l], k[l]);
      for (int p = 0; p < 27; ++p) normals[p][l] = near_[static_cast<std::size_t>(p)];
    }
    for (int p = 0; different == 1 && p < 27; ++p) std::fill_n(normals[p], block, normals[p][0]);
    cell_lanes::multiply_by_field(splines, normals, roots, root + at);
  }
}

float TexturePatch::root_at(Vec3d place_m) {
  std::array<double, cell_lanes::block> x, y, z, root;
  x.fill(place_m.x), y.fill(place_m.y), z.fill(place_m.z), root.fill(1);
  multiply({x.data(), y.data(), z.data()}, cell_lanes::block, root.data());
  return static_cast<float>(root.front());
}

}  // namespace sonar
