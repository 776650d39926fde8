// The pulse of one ping: the receiver's output for one point echo, as a function of time and of frequency, for all shapes
// (docs/acoustics.md, section 4). The file also declares the tables of the pulse for synthesis and noise.
#pragma once

#include <complex>
#include <string>
#include <vector>

#include "core/pipeline/pulses/spectral.hpp"
#include "core/sonar/sonar_model.hpp"

namespace sonar {

class Pulse {
 public:
  Pulse() = default;
  /// `width_s`: -3 dB width of |p|^2 in delay, 2 / c times the width in range. A measured pulse ignores it.
  Pulse(const Waveform& waveform, double width_s);

  Waveform::Shape shape() const { return shape_; }
  bool is_real() const { return shape_ != Waveform::Shape::measured; }
  /// p(t), p(0) = 1. A measured pulse is interpolated from 32 samples; the error is 1e-4 up to 0.8 of its band.
  std::complex<double> at(double time_s) const;
  /// P(nu) = integral of p(t) e^{-i 2 pi nu t} dt [s].
  std::vector<std::complex<double>> spectrum_s(const spectral::FrequencyGrid& grid) const;

  double width_s() const { return width_s_; }
  /// p is zero beyond this delay (Gaussian: below 2e-10).
  double reach_s() const { return reach_s_; }
  /// Width of the band about zero outside which P is negligible: below 1e-6 of its peak; for a measured pulse, below 1e-4. A
  /// tone has corners, which need an unlimited band; its limit is 4e-4.
  double band_hz() const { return band_hz_; }
  /// tau_eff = integral of |p|^2 dt.
  double energy_width_s() const { return energy_width_s_; }
  /// B_n = integral of |P|^2 d nu over the largest |P|^2.
  double noise_bandwidth_hz() const { return noise_bandwidth_hz_; }
  /// Correlation of noise shaped by p: integral of p(t') p*(t' - t) dt' / tau_eff.
  std::complex<double> correlation(double time_s) const;

 private:
  void take_samples(const Waveform& waveform);
  void integrate();

  Waveform::Shape shape_ = Waveform::Shape::gaussian;
  double scale_hz_ = 1;  // Gaussian b, 1 / the tone's length, the sweep's bandwidth, the sample rate
  double width_s_ = 1, reach_s_ = 1, band_hz_ = 1, energy_width_s_ = 1, noise_bandwidth_hz_ = 1;
  std::vector<std::complex<double>> samples_;  // measured: the samples that are not negligible; the peak is samples_[middle_]
  int middle_ = 0;
};

/// A sentence with the reason why the pulse cannot be used with this sample time; empty if it can.
std::string why_invalid(const Waveform& waveform, double sample_time_s);

/// The sweep's bandwidth for a -3 dB width of the compressed pulse in delay.
double sweep_bandwidth_hz(double width_s);

/// Makes simd::PulseRows of the real part of p, or of |p|^2, on a grid with this sample time.
std::vector<float> make_pulse_rows(const Pulse& pulse, double sample_time_s, int taps, int steps, bool squared);
/// Number of taps of such rows, a multiple of 8.
int taps_of(const Pulse& pulse, double sample_time_s);

/// Real taps h for which sum_n h_n h_{n+k} = Re correlation(k sample times), and sum_n h_n h_n = 1. White noise filtered by h has
/// the pulse's correlation on this grid. (For a complex pulse, the noise gets the mean of the pulse's spectrum and the mirrored
/// spectrum.)
std::vector<float> make_noise_filter(const Pulse& pulse, double sample_time_s);

}  // namespace sonar
