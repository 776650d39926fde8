// Absorption, sound speed, density and pressure of the water, from published formulae with their published digits. A ping
// computes each value once; the code of vendors uses the formulae for values that their devices assume.
#include "core/sonar/water.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace sonar {
namespace {

/// Evaluates c[0] + c[1] x + c[2] x^2 + ...
template <std::size_t N>
double polynomial(double x, const double (&c)[N]) {
  double sum = 0;
  for (std::size_t i = N; i-- > 0;) sum = sum * x + c[i];
  return sum;
}

/// One relaxation term f_r f^2 / (f_r^2 + f^2). All frequencies have the same unit.
double relaxation(double resonance, double f) { return resonance * f * f / (resonance * resonance + f * f); }

}  // namespace

// Francois & Garrison 1982, JASA 72(3) and 72(6). f in kHz, z in m, result in dB/km.
// The data reach 1 MHz. Above, only the viscous f^2 term of pure water matters, which is accurate to 3 MHz and beyond.
double absorption_db_per_m(const Water& water, double depth_m, double frequency_hz) {
  const double t = water.temperature_c, s = std::max(water.salinity_psu, 0.0), z = std::max(depth_m, 0.0);
  const double f = frequency_hz * 1e-3;
  const double c = 1412 + 3.21 * t + 1.19 * s + 0.0167 * z;

  double salts = 0;  // boric acid and magnesium sulphate; neither in fresh water
  if (s > 0) {
    const double a1 = 8.86 / c * std::pow(10.0, 0.78 * water.ph - 5);
    const double f1 = 2.8 * std::sqrt(s / 35) * std::pow(10.0, 4 - 1245 / (t + 273));
    const double a2 = 21.44 * s / c * (1 + 0.025 * t);
    const double p2 = 1 - 1.37e-4 * z + 6.2e-9 * z * z;
    const double f2 = 8.17 * std::pow(10.0, 8 - 1990 / (t + 273)) / (1 + 0.0018 * (s - 35));
    salts = a1 * relaxation(f1, f) + a2 * p2 * relaxation(f2, f);
  }
  const double a3 =
      t <= 20 ? polynomial(t, {4.937e-4, -2.59e-5, 9.11e-7, -1.5e-8}) : polynomial(t, {3.964e-4, -1.146e-5, 1.45e-7, -6.5e-10});
  const double p3 = 1 - 3.83e-5 * z + 4.9e-10 * z * z;
  return (salts + a3 * p3 * f * f) * 1e-3;
}

// Chen & Millero 1977 as printed in UNESCO technical papers in marine science 44 (1983); temperatures T68, pressure in bar.
double sound_speed_unesco_mps(double temperature_c, double salinity_psu, double pressure_bar) {
  const double t = temperature_c, s = std::max(salinity_psu, 0.0), p = pressure_bar;
  const double c0 = polynomial(t, {1402.388, 5.03711, -5.80852e-2, 3.3420e-4, -1.47800e-6, 3.1464e-9});
  const double c1 = polynomial(t, {0.153563, 6.8982e-4, -8.1788e-6, 1.3621e-7, -6.1185e-10});
  const double c2 = polynomial(t, {3.1260e-5, -1.7107e-6, 2.5974e-8, -2.5335e-10, 1.0405e-12});
  const double c3 = polynomial(t, {-9.7729e-9, 3.8504e-10, -2.3643e-12});
  const double a0 = polynomial(t, {1.389, -1.262e-2, 7.164e-5, 2.006e-6, -3.21e-8});
  const double a1 = polynomial(t, {9.4742e-5, -1.2580e-5, -6.4885e-8, 1.0507e-8, -2.0122e-10});
  const double a2 = polynomial(t, {-3.9064e-7, 9.1041e-9, -1.6002e-10, 7.988e-12});
  const double a3 = polynomial(t, {1.100e-10, 6.649e-12, -3.389e-13});
  const double b = -1.922e-2 - 4.42e-5 * t + (7.3637e-5 + 1.7945e-7 * t) * p;
  const double d = 1.727e-3 - 7.9836e-6 * p;
  return polynomial(p, {c0, c1, c2, c3}) + polynomial(p, {a0, a1, a2, a3}) * s + b * s * std::sqrt(s) + d * s * s;
}

// Millero & Poisson 1981 (EOS-80), one atmosphere.
double density_kg_per_m3(double temperature_c, double salinity_psu) {
  const double t = temperature_c, s = std::max(salinity_psu, 0.0);
  const double pure = polynomial(t, {999.842594, 6.793952e-2, -9.095290e-3, 1.001685e-4, -1.120083e-6, 6.536332e-9});
  const double a = polynomial(t, {8.24493e-1, -4.0899e-3, 7.6438e-5, -8.2467e-7, 5.3875e-9});
  const double b = polynomial(t, {-5.72466e-3, 1.0227e-4, -1.6546e-6});
  return pure + a * s + b * s * std::sqrt(s) + 4.8314e-4 * s * s;
}

double absolute_pressure_bar(const Water& water, double depth_m) {
  return 1.013 + 0.0981 * std::max(depth_m, 0.0) * density_kg_per_m3(water.temperature_c, water.salinity_psu) / 1000;
}

double true_sound_speed_mps(const Water& water, double depth_m) {
  if (water.sound_speed_mps > 0) return water.sound_speed_mps;
  const double gauge_bar = absolute_pressure_bar(water, depth_m) - absolute_pressure_bar(water, 0);
  return sound_speed_unesco_mps(water.temperature_c, water.salinity_psu, gauge_bar);
}

}  // namespace sonar
