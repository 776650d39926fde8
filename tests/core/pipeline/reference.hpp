// The slow reference: eq. (8) and (9) of the acoustic model summed directly in double, and closed forms of the expected levels.
// It shares the formulae of core/pipeline/arithmetic with the engine, but not its tables, grids and float arithmetic.
#pragma once

#include <complex>
#include <span>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/sonar/sonar_model.hpp"

namespace sonar::reference {

using Complex = std::complex<double>;

/// Properties of the water and of the transmitted pulse.
struct Medium {
  double sound_speed_mps = 1500;
  double absorption_np_per_m = 0;
  double source_upa = 1;
};

/// An echo before the azimuth receive pattern: A_i of eq. (6), including the carrier.
struct Scatterer {
  double range_m = 0, sine = 0;  // sine = y / r in the sonar's frame
  Complex amplitude;             // [uPa]
};

/// Samples at true ranges first + n spacing.
struct Grid {
  double sound_speed_mps = 1500, envelope_hz = 0;
  double first_range_m = 0, spacing_m = 0;
  int samples = 0;
  double time_s(int n) const { return 2 * (first_range_m + n * spacing_m) / sound_speed_mps; }
  double sample_rate_hz() const { return sound_speed_mps / (2 * spacing_m); }
};

/// Eq. (6) for a scatterer of cross-section sigma at a point in the sonar's frame.
Scatterer scatterer_at(const FrequencyMode& mode, const Medium& medium, Vec3d in_sonar, double sigma_m2, Complex xi);

/// Eq. (8): g[n] = sum_i A_i p(t_n - tau_i).
std::vector<Complex> signal_in_time(std::span<const Scatterer> scatterers, const Grid& grid);
/// Eq. (8) by the discrete spectrum: P(nu_m) = P_hat(nu_m) sum_i A_i e^{-i 2 pi nu_m tau_i}, inverse transform, scaled by the
/// sample rate. It wraps the tails of pulses. Therefore it equals signal_in_time only for delays of at least 4 / b from both
/// ends.
std::vector<Complex> signal_in_frequency(std::span<const Scatterer> scatterers, const Grid& grid);

/// Eq. (9): s_j[n] = sum_i D(u_i - u_j) A_i p(t_n - tau_i), with the exact sine of each scatterer. [beams][samples]
std::vector<std::vector<Complex>> beams(std::span<const Scatterer> scatterers, std::span<const double> beam_sines,
                                        const BeamPattern& pattern, const Grid& grid);
/// E|s_j[n]|^2 = sum_i D^2 |A_i|^2 p^2 for independent scatterers of unit mean power.
std::vector<std::vector<double>> expected_power(std::span<const Scatterer> scatterers, std::span<const double> beam_sines,
                                                const BeamPattern& pattern, const Grid& grid);

// Closed forms. All are expected power E|s|^2 in dB re 1 uPa^2 unless stated otherwise.

/// Oracle 8: flat seabed at `height_m` below the sonar, Lambert 10 log10 mu, conical columns, range r: SL - 40 log r - 2 alpha
/// r + S_b + 10 log10(theta_eff r (c / 2) tau_eff F), sin g = h / r. F = 1 / cos g at azimuth 0 and r / sqrt(r^2 (1 - u^2) -
/// h^2) in a beam of sine u. The two-way elevation pattern is added (tilt: nose of the sonar down is positive).
class SeabedLevel {
 public:
  SeabedLevel(const FrequencyMode& mode, const Medium& medium, double envelope_hz, double lambert_db, double height_m,
              double tilt_rad);
  double db(double range_m, double sine = 0) const;
  /// Return the angle about the array axis at which a beam sees the bottom at a range, and the two-way pattern at this angle.
  double psi_rad(double range_m, double sine = 0) const;
  double pattern(double range_m, double sine = 0) const;

 private:
  Medium medium_;
  double height_m_, tilt_rad_, lambert_db_, area_per_m2_;
  bool has_pattern_;
  double elevation_aperture_;
};

/// Oracle 5, absolute: integral of E|s|^2 dt over an infinite wall straight ahead at `distance_m`, alpha = 0, beam at azimuth
/// 0, elevations up to `half_fan_rad`. [uPa^2 s]
double wall_energy(const FrequencyMode& mode, const Medium& medium, double envelope_hz, double mu, double distance_m,
                   double half_fan_rad);

/// Oracle 9: sum sigma_i / r_i^4 [1/m^2] over the visible cap of a Lambert sphere of radius a with its centre at d. This is the
/// exact integral; to first order it is (2 pi / 3) mu a^2 (1 + 1.5 a / d) / d^4.
double sphere_echo_per_m2(double mu, double radius_m, double distance_m);

}  // namespace sonar::reference
