// Fresnel integrals C(x) and S(x), which give the echo of a limited mirror (docs/acoustics.md, section 3). The file uses only
// C++17 and the standard library.
#pragma once

#include <cmath>

#include "core/base/geometry.hpp"
#include "core/base/host_device.hpp"

namespace sonar {

/// C(x) = integral of cos(pi t^2 / 2) from 0 to x, S(x) = integral of the sine. This is the standard definition; both are 1/2
/// at infinity.
struct FresnelPair {
  double c = 0, s = 0;
};

/// Sum of the power series: C + iS = sum_n (i pi / 2)^n x^(2n + 1) / (n! (2n + 1)). It is used for small x; at x = 2.4 it loses 4
/// digits.
SONAR_HD inline FresnelPair fresnel_series(double x) {
  const double step = 0.5 * pi * x * x;
  FresnelPair sum;
  double term = x;  // x (pi x^2 / 2)^n / n!
  for (int n = 0; n < 60 && std::fabs(term) > 1e-13; ++n) {
    const double part = term / (2 * n + 1);
    switch (n & 3) {
      case 0:
        sum.c += part;
        break;
      case 1:
        sum.s += part;
        break;
      case 2:
        sum.c -= part;
        break;
      default:
        sum.s -= part;
        break;
    }
    term *= step / (n + 1);
  }
  return sum;
}

/// C + iS = (1 + i) / 2 (1 - erfc z), z = sqrt(pi) / 2 (1 - i) x. The continued fraction of erfc (Abramowitz & Stegun 7.1.14)
/// is evaluated backwards. It is used for x of at least 2.4.
SONAR_HD inline FresnelPair fresnel_fraction(double x) {
  const double zr = 0.5 * std::sqrt(pi) * x, zi = -zr;
  double fr = zr, fi = zi;
  for (int n = x < 4 ? 40 : 14; n >= 1; --n) {  // f = z + (n / 2) / f
    const double scale = 0.5 * n / (fr * fr + fi * fi);
    const double r = zr + scale * fr, i = zi - scale * fi;
    fr = r, fi = i;
  }
  // erfc z = e^{-z^2} / (sqrt(pi) f), and -z^2 = i pi x^2 / 2
  const double turns = 0.25 * x * x, angle = 2 * pi * (turns - std::floor(turns));
  const double scale = 1 / (std::sqrt(pi) * (fr * fr + fi * fi)), co = std::cos(angle), si = std::sin(angle);
  const double er = scale * (co * fr + si * fi), ei = scale * (si * fr - co * fi);
  return {0.5 * (1 - er + ei), 0.5 * (1 - er - ei)};
}

/// Returns both integrals, accurate to 1e-9 for every x, also at infinity.
SONAR_HD inline FresnelPair fresnel(double x) {
  const double a = std::fabs(x), sign = x < 0 ? -1.0 : 1.0;
  if (a > 1e8) return {0.5 * sign, 0.5 * sign};
  const FresnelPair f = a < 2.4 ? fresnel_series(a) : fresnel_fraction(a);
  return {sign * f.c, sign * f.s};
}

}  // namespace sonar
