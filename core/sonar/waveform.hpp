// The matched filter's output for one point echo: the pulse p(t), p(0) = 1. A constant of the product; its width
// follows the client's settings (PingSettings::pulse_width_m) unless it was measured (docs/acoustics.md, section 4).
#pragma once

#include <complex>
#include <vector>

namespace sonar {

struct Waveform {
  enum class Shape {
    gaussian,  // exp(-b^2 t^2), Choi 2025 eq. 3; the default
    cw,        // a rectangular tone of length T after its matched filter: a triangle, -3 dB width 0.293 c T
    lfm,       // a linear sweep after compression with a Hamming window: side lobes at -42 dB, -3 dB width 1.30 / sweep
    measured,  // `samples`
  };
  Shape shape = Shape::gaussian;
  /// lfm: time the sweep takes, and its sign (falling sweeps shift the other way). Decides the Doppler range shift only.
  float sweep_s = 1e-3f;
  bool falling = false;
  /// measured: complex envelope after the matched filter at sample_rate_hz, the peak in the middle, at most 65536 samples.
  std::vector<std::complex<float>> samples;
  double sample_rate_hz = 0;
  /// Frequency-domain synthesis (exact up to the band limit) where the tabulated pulse would do; `measured` always uses it.
  bool exact = false;
#if __cplusplus >= 202002L  // device code is C++17 and compares none
  bool operator==(const Waveform&) const = default;
#endif
};

}  // namespace sonar
