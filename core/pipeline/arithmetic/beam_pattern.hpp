// Closed forms of the directivity: of the receive array in azimuth, and of transmitter times receiver in elevation. The file uses
// only C++17 and the standard library, because nvcc compiles it, too.
#pragma once

#include <cmath>
#include <cstddef>

#include "core/base/geometry.hpp"
#include "core/base/host_device.hpp"
#include "core/sonar/sonar_model.hpp"

namespace sonar {

/// Largest number of terms of a taper's cosine series.
inline constexpr int taper_terms = 4;

/// Aperture shading g(p) = 1 + 2 sum_m c[m] cos(2 pi m p), p = position on the aperture / its length; c[0] = 1. Its far-field
/// amplitude is D(x) = sum_m c[|m|] sinc(x - m), x = aperture / wavelength * sine offset; D(0) = 1.
struct TaperSeries {
  double c[taper_terms] = {1, 0, 0, 0};
};

/// sin(pi x) / (pi x)
SONAR_HD inline double sinc(double x) {
  const double a = pi * x;
  return std::fabs(a) < 1e-4 ? 1 - a * a / 6 : std::sin(a) / a;
}

/// Taylor 1955 one-parameter line source, nbar = 4, design side lobes -30 dB. The first nbar - 1 zeros move to
/// z_n = sigma sqrt(A^2 + (n - 1/2)^2), A = acosh(10^(30/20)) / pi, sigma^2 = nbar^2 / (A^2 + (nbar - 1/2)^2).
SONAR_HD inline TaperSeries taylor30_series() {
  constexpr int nbar = taper_terms;
  const double a = std::acosh(std::pow(10.0, 30.0 / 20.0)) / pi;
  const double sigma2 = nbar * nbar / (a * a + (nbar - 0.5) * (nbar - 0.5));
  TaperSeries series;
  for (int m = 1; m < nbar; ++m) {
    double value = 1;  // ((nbar-1)!)^2 / ((nbar-1+m)! (nbar-1-m)!), factor by factor
    for (int i = 1; i <= m; ++i) value *= static_cast<double>(nbar - i) / (nbar - 1 + i);
    for (int n = 1; n < nbar; ++n) value *= 1 - m * m / (sigma2 * (a * a + (n - 0.5) * (n - 0.5)));
    series.c[m] = value;
  }
  return series;
}

SONAR_HD inline TaperSeries taper_series(Taper taper) {
  TaperSeries series;
  if (taper == Taper::taylor30) return taylor30_series();
  if (taper == Taper::hamming) series.c[1] = 0.23 / 0.54;
  if (taper == Taper::hann) series.c[1] = 0.5;
  return series;
}

/// Signed amplitude D(x) of a series, see TaperSeries.
SONAR_HD inline double series_amplitude(const TaperSeries& series, double x) {
  double sum = sinc(x);
  for (int m = 1; m < taper_terms; ++m) {
    if (series.c[m] != 0) sum += series.c[m] * (sinc(x - m) + sinc(x + m));
  }
  return sum;
}

/// Signed amplitude at x = aperture / wavelength * sine offset; 1 everywhere for `unit`.
SONAR_HD inline double beam_amplitude(Taper taper, double x) {
  return taper == Taper::unit ? 1.0 : series_amplitude(taper_series(taper), x);
}

/// The x > 0 on the main lobe at which D(x) falls to `level` (0 < level < 1).
SONAR_HD inline double main_lobe_crossing(const TaperSeries& series, double level) {
  double low = 0, high = 1;  // at x = 1, D of every taper here is below 0.7; up to there it falls monotonically
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (series_amplitude(series, middle) > level ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// -3 dB width in units of wavelength / aperture: uniform 0.886, taylor30 1.125, hamming 1.303, hann 1.441.
SONAR_HD inline double width_factor(Taper taper) {
  return taper == Taper::unit ? 1.0 : 2 * main_lobe_crossing(taper_series(taper), std::sqrt(0.5));
}

/// Aperture in wavelengths for a -3 dB width [rad] at broadside. The beam then spans +-sin(width / 2) (docs/acoustics.md, eq.
/// 33).
SONAR_HD inline double aperture_in_wavelengths(Taper taper, double width_rad) {
  return width_factor(taper) / (2 * std::sin(0.5 * width_rad));
}

/// Signed receive amplitude W of eq. (9): `du` = difference of the direction sines of source and beam axis.
SONAR_HD inline double directivity(Taper taper, double aperture_wavelengths, double du) {
  return beam_amplitude(taper, aperture_wavelengths * du);
}

/// directivity() with precomputed constants, for loops.
struct ReceivePattern {
  bool unit = false;
  TaperSeries series;
  double aperture_wavelengths = 0;
  SONAR_HD double operator()(double du) const { return unit ? 1.0 : series_amplitude(series, aperture_wavelengths * du); }
};
SONAR_HD inline ReceivePattern receive_pattern(const BeamPattern& pattern) {
  return {pattern.azimuth_taper == Taper::unit, taper_series(pattern.azimuth_taper),
          aperture_in_wavelengths(pattern.azimuth_taper, static_cast<double>(pattern.azimuth_width_rad))};
}

/// Pattern of beam `j`. Listed beams may have different widths w; in the sine, w spans 2 sin(w / 2) cos(azimuth).
inline ReceivePattern receive_pattern(const FrequencyMode& mode, std::size_t j) {
  ReceivePattern pattern = receive_pattern(mode.pattern);
  if (!mode.has_own_widths()) return pattern;
  pattern.aperture_wavelengths =
      aperture_in_wavelengths(mode.pattern.azimuth_taper, static_cast<double>(mode.beam_widths_rad[j])) /
      std::cos(mode.beam_azimuths_rad[j]);
  return pattern;
}

/// Integral of D^2 over u, the limit of sum_k W_jk^2 du_k. It is the width in sine space from which a beam collects scatterers.
/// The terms of the series are orthonormal, so this value is exact. Not defined for `unit`.
SONAR_HD inline double effective_beam_width_u(Taper taper, double aperture_wavelengths) {
  const TaperSeries series = taper_series(taper);
  double sum = 1;
  for (int m = 1; m < taper_terms; ++m) sum += 2 * series.c[m] * series.c[m];
  return sum / aperture_wavelengths;
}

/// Vertical aperture in wavelengths of each of the two equal sincs (transmit, receive). At half of the data sheet's width from
/// the axis, one pattern (one_way) or the product of both (two_way) is at half power.
SONAR_HD inline double elevation_aperture_in_wavelengths(const BeamPattern& pattern) {
  const double level = pattern.elevation_width_is == ElevationWidthIs::one_way ? std::sqrt(0.5) : std::sqrt(std::sqrt(0.5));
  const double half_width = 0.5 * static_cast<double>(pattern.elevation_width_rad);
  return main_lobe_crossing(TaperSeries{}, level) / std::sin(half_width);
}

/// Amplitude Dtx * Erx at angle psi about the array axis [rad] for a known aperture; 0 behind the array.
SONAR_HD inline double elevation_two_way(double elevation_aperture_wavelengths, double psi_rad) {
  if (std::fabs(psi_rad) >= 0.5 * pi) return 0;
  const double d = sinc(elevation_aperture_wavelengths * std::sin(psi_rad));
  return d * d;
}
/// Like elevation_two_way() for a known aperture, but from the data sheet's widths. It solves for the aperture, so loops should
/// compute the aperture once.
SONAR_HD inline double elevation_two_way(const BeamPattern& pattern, double psi_rad) {
  if (pattern.elevation_taper == Taper::unit) return std::fabs(psi_rad) < 0.5 * pi ? 1 : 0;
  return elevation_two_way(elevation_aperture_in_wavelengths(pattern), psi_rad);
}

/// The |psi| at which Dtx * Erx has fallen to `level` (0 < level < 1, amplitude). A fan must extend to this angle. pi / 2 for
/// `unit`.
SONAR_HD inline double elevation_reach_rad(const BeamPattern& pattern, double level) {
  if (pattern.elevation_taper == Taper::unit) return 0.5 * pi;
  const double sine = main_lobe_crossing(TaperSeries{}, std::sqrt(level)) / elevation_aperture_in_wavelengths(pattern);
  return sine < 1 ? std::asin(sine) : 0.5 * pi;
}

/// An array along y measures u = cos(elevation) sin(azimuth); psi is the angle about that axis (docs/acoustics.md, section 1).
struct ConicalDirection {
  double u = 0, psi_rad = 0;
};
SONAR_HD inline ConicalDirection conical_from_sonar(Vec3d direction_in_sonar) {
  return {direction_in_sonar.y / length(direction_in_sonar), std::atan2(direction_in_sonar.z, direction_in_sonar.x)};
}
/// Flat beams of constant azimuth (Choi 2025): u = sin(azimuth), psi = elevation from the x-y plane.
SONAR_HD inline ConicalDirection flat_from_sonar(Vec3d direction_in_sonar) {
  const double h = std::sqrt(direction_in_sonar.x * direction_in_sonar.x + direction_in_sonar.y * direction_in_sonar.y);
  return {direction_in_sonar.y / h, std::atan2(direction_in_sonar.z, h)};
}
/// sonar_from_conical() and sonar_from_flat() invert the two functions above; they return unit vectors.
SONAR_HD inline Vec3d sonar_from_conical(const ConicalDirection& d) {
  const double across = std::sqrt(std::fmax(0.0, 1 - d.u * d.u));
  return {across * std::cos(d.psi_rad), d.u, across * std::sin(d.psi_rad)};
}
SONAR_HD inline Vec3d sonar_from_flat(const ConicalDirection& d) {
  const double across = std::sqrt(std::fmax(0.0, 1 - d.u * d.u));
  return {across * std::cos(d.psi_rad), d.u * std::cos(d.psi_rad), std::sin(d.psi_rad)};
}
/// The direction in float, from u, sqrt(1 - u^2), and the sine and cosine of psi. Float is sufficient for rays, because rays
/// only determine shadows.
SONAR_HD constexpr Vec3 ray_in_sonar(bool conical, float u, float across, float cosine, float sine) {
  return {across * cosine, conical ? u : u * cosine, conical ? across * sine : sine};
}

}  // namespace sonar
