#include "tests/core/pipeline/reference.hpp"

#include <cmath>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"

namespace sonar::reference {
namespace {

constexpr double pulse_reach_bt = 7;  // p < 1e-21 beyond

template <class Sum>
void over_pulse(const Scatterer& s, const Grid& grid, Sum&& sum) {
  const double tau = 2 * s.range_m / grid.sound_speed_mps, reach = pulse_reach_bt / grid.envelope_hz;
  const double step = 2 * grid.spacing_m / grid.sound_speed_mps, first = grid.time_s(0);
  const int from = std::max(0, static_cast<int>(std::ceil((tau - reach - first) / step)));
  const int to = std::min(grid.samples - 1, static_cast<int>(std::floor((tau + reach - first) / step)));
  for (int n = from; n <= to; ++n) sum(static_cast<std::size_t>(n), envelope(grid.envelope_hz, grid.time_s(n) - tau));
}

}  // namespace

Scatterer scatterer_at(const FrequencyMode& mode, const Medium& medium, Vec3d in_sonar, double sigma_m2, Complex xi) {
  const double r = length(in_sonar);
  const ConicalDirection d = conical_from_sonar(in_sonar);
  const double amplitude = medium.source_upa * std::sqrt(sigma_m2) * two_way_transmission(r, medium.absorption_np_per_m) *
                           elevation_two_way(mode.pattern, d.psi_rad);
  const double turns = fraction_of_turn(2 * static_cast<double>(mode.centre_hz) * r / medium.sound_speed_mps);
  return {r, d.u, xi * std::polar(amplitude, -2 * pi * turns)};
}

std::vector<Complex> signal_in_time(std::span<const Scatterer> scatterers, const Grid& grid) {
  std::vector<Complex> g(static_cast<std::size_t>(grid.samples));
  for (const Scatterer& s : scatterers) over_pulse(s, grid, [&](std::size_t n, double p) { g[n] += p * s.amplitude; });
  return g;
}

std::vector<Complex> signal_in_frequency(std::span<const Scatterer> scatterers, const Grid& grid) {
  const int m_count = grid.samples;
  const double rate = grid.sample_rate_hz();
  std::vector<Complex> spectrum(static_cast<std::size_t>(m_count)), root(static_cast<std::size_t>(m_count));
  for (int m = 0; m < m_count; ++m) {
    const double nu = rate * (m < (m_count + 1) / 2 ? m : m - m_count) / m_count;
    Complex sum;
    for (const Scatterer& s : scatterers) {
      sum += s.amplitude * std::polar(1.0, -2 * pi * nu * (2 * s.range_m / grid.sound_speed_mps - grid.time_s(0)));
    }
    spectrum[static_cast<std::size_t>(m)] = rate * envelope_spectrum_s(grid.envelope_hz, nu) * sum;
    root[static_cast<std::size_t>(m)] = std::polar(1.0, 2 * pi * m / m_count);
  }
  std::vector<Complex> g(static_cast<std::size_t>(m_count));
  for (std::size_t n = 0; n < g.size(); ++n) {
    for (std::size_t m = 0; m < g.size(); ++m) g[n] += spectrum[m] * root[n * m % g.size()];
    g[n] /= m_count;
  }
  return g;
}

std::vector<std::vector<Complex>> beams(std::span<const Scatterer> scatterers, std::span<const double> beam_sines,
                                        const BeamPattern& pattern, const Grid& grid) {
  const ReceivePattern weight = receive_pattern(pattern);
  std::vector<std::vector<Complex>> s(beam_sines.size(), std::vector<Complex>(static_cast<std::size_t>(grid.samples)));
  for (std::size_t j = 0; j < beam_sines.size(); ++j) {
    for (const Scatterer& i : scatterers) {
      const Complex a = weight(i.sine - beam_sines[j]) * i.amplitude;
      over_pulse(i, grid, [&](std::size_t n, double p) { s[j][n] += p * a; });
    }
  }
  return s;
}

std::vector<std::vector<double>> expected_power(std::span<const Scatterer> scatterers, std::span<const double> beam_sines,
                                                const BeamPattern& pattern, const Grid& grid) {
  const ReceivePattern weight = receive_pattern(pattern);
  std::vector<std::vector<double>> s(beam_sines.size(), std::vector<double>(static_cast<std::size_t>(grid.samples)));
  for (std::size_t j = 0; j < beam_sines.size(); ++j) {
    for (const Scatterer& i : scatterers) {
      const double power = std::norm(weight(i.sine - beam_sines[j]) * i.amplitude);
      over_pulse(i, grid, [&](std::size_t n, double p) { s[j][n] += p * p * power; });
    }
  }
  return s;
}

SeabedLevel::SeabedLevel(const FrequencyMode& mode, const Medium& medium, double envelope_hz, double lambert_db, double height_m,
                         double tilt_rad)
    : medium_(medium),
      height_m_(height_m),
      tilt_rad_(tilt_rad),
      lambert_db_(lambert_db),
      has_pattern_(mode.pattern.elevation_taper != Taper::unit),
      elevation_aperture_(elevation_aperture_in_wavelengths(mode.pattern)) {
  const Taper taper = mode.pattern.azimuth_taper;
  const double theta =
      effective_beam_width_u(taper, aperture_in_wavelengths(taper, static_cast<double>(mode.pattern.azimuth_width_rad)));
  area_per_m2_ = theta * 0.5 * medium.sound_speed_mps * energy_width_s(envelope_hz);
}

double SeabedLevel::psi_rad(double range_m, double sine) const {
  const double ahead = std::sqrt(range_m * range_m * (1 - sine * sine) - height_m_ * height_m_);
  return tilt_rad_ - std::atan2(height_m_, ahead);
}

double SeabedLevel::pattern(double range_m, double sine) const {
  return has_pattern_ ? elevation_two_way(elevation_aperture_, psi_rad(range_m, sine)) : 1;
}

double SeabedLevel::db(double range_m, double sine) const {
  const double strength_db = lambert_db_ + 20 * std::log10(height_m_ / range_m);
  const double oblique = range_m / std::sqrt(range_m * range_m * (1 - sine * sine) - height_m_ * height_m_);
  return 20 * std::log10(medium_.source_upa * two_way_transmission(range_m, medium_.absorption_np_per_m) *
                         pattern(range_m, sine)) +
         strength_db + 10 * std::log10(area_per_m2_ * range_m * oblique);
}

// sigma = mu cos(a) r^2 du dpsi with cos(a) = sqrt(1 - u^2) cos(psi) = d / r: power mu cos^3(a) / d^2, integrated over the beam.
double wall_energy(const FrequencyMode& mode, const Medium& medium, double envelope_hz, double mu, double distance_m,
                   double half_fan_rad) {
  const ReceivePattern weight = receive_pattern(mode.pattern);
  double over_psi = 0, over_u = 0;
  const double dpsi = 1e-4, du = 1e-4;
  for (double psi = -half_fan_rad + dpsi / 2; psi < half_fan_rad; psi += dpsi) {
    over_psi += std::pow(elevation_two_way(mode.pattern, psi), 2) * std::pow(std::cos(psi), 3) * dpsi;
  }
  for (double u = -0.9999; u < 1; u += du) over_u += std::pow(weight(u), 2) * std::pow(1 - u * u, 1.5) * du;
  return medium.source_upa * medium.source_upa * mu / (distance_m * distance_m) * over_psi * over_u * energy_width_s(envelope_hz);
}

double sphere_echo_per_m2(double mu, double radius_m, double distance_m) {
  const double a = radius_m, d = distance_m, dt = 1e-5;
  double sum = 0;
  for (double t = dt / 2; t < std::acos(a / d); t += dt) {  // t: angle at the centre, up to the tangent cone
    const double r2 = d * d + a * a - 2 * a * d * std::cos(t);
    const double cosine = (d * std::cos(t) - a) / std::sqrt(r2);
    sum += lambert_per_area(mu, cosine) * 2 * pi * a * a * std::sin(t) * dt / (r2 * r2);
  }
  return sum;
}

}  // namespace sonar::reference
