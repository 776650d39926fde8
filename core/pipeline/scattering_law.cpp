#include "core/pipeline/scattering_law.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/units.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"

namespace sonar {
namespace {

double from_db(float db) { return power_from_db(static_cast<double>(db)); }

/// sigma_b = A e^{-a^2 / 2 B^2} + C cos^D a + E e^{-a^2 / 2 F^2} (docs/acoustics.md, eq. 13).
double gsab(const GsabLaw& g, double cosine) {
  const double a = std::acos(std::clamp(cosine, 0.0, 1.0));
  const auto bell = [a](float db, float width_rad) {
    const double x = a / static_cast<double>(width_rad);
    return from_db(db) * std::exp(-0.5 * x * x);
  };
  return bell(g.a_db, g.b_rad) + from_db(g.c_db) * std::pow(cosine, static_cast<double>(g.d)) + bell(g.e_db, g.f_rad);
}

double lambert_mu(const Material& m) { return lambert_coefficient(static_cast<double>(m.lambert_db)); }

/// The strength at normal incidence, where every law is strongest.
double strongest(const Material& m) { return m.law == ScatteringLaw::gsab ? gsab(m.gsab, 1) : lambert_mu(m); }

/// 10^(trend decades / 10); decades are counted from the reference frequency.
double trend(const Material& m, double centre_hz) {
  if (m.trend_db_per_decade == 0) return 1;
  const double decades = std::log10(centre_hz / static_cast<double>(m.trend_reference_hz));
  // The limit: no surface backscatters more than the incident energy.
  return std::min(power_from_db(static_cast<double>(m.trend_db_per_decade) * decades), largest_lambert / strongest(m));
}

/// k h with k = 2 pi f / c: the rms roughness as a phase [rad].
double phase_roughness(const Material& m, double centre_hz, double sound_speed_mps) {
  return 2 * pi * centre_hz / sound_speed_mps * static_cast<double>(m.roughness_m);
}

}  // namespace

double scattering_strength(const Material& m, double cosine, double centre_hz, double sound_speed_mps, bool specular) {
  const double law = m.law == ScatteringLaw::gsab ? gsab(m.gsab, cosine) : lambert_per_area(lambert_mu(m), cosine);
  const double kh = phase_roughness(m, centre_hz, sound_speed_mps);
  const bool smooth = specular && kh < smooth_below_kh;
  // The part that is not in the specular echo: 1 - e^{-4 k^2 h^2 cos^2 a} (eq. 14).
  const double scattered = smooth ? 1 - std::exp(-4 * kh * kh * cosine * cosine) : 1;
  return law * scattered * trend(m, centre_hz);
}

float LawTable::root_strength(float cosine) const { return static_cast<float>(std::sqrt(mu)) * relative_root(cosine); }

LawTable make_law(const Material& m, double centre_hz, double sound_speed_mps, bool specular) {
  LawTable law;
  law.mu = lambert_mu(m) * trend(m, centre_hz);
  const bool smooth = specular && phase_roughness(m, centre_hz, sound_speed_mps) < smooth_below_kh;
  if (m.law == ScatteringLaw::lambert && !smooth) return law;
  // x = sqrt(1 - cosine): uniform steps in x resolve a peak at normal incidence.
  for (int i = 0; i < law_steps + 2; ++i) {
    const double x = std::min(1.0, static_cast<double>(i) / law_steps);
    const double sigma = scattering_strength(m, 1 - x * x, centre_hz, sound_speed_mps, specular);
    law.root.push_back(static_cast<float>(std::sqrt(sigma / law.mu)));
  }
  return law;
}

}  // namespace sonar
