// The pulse p(t), p(0) = 1: the output of the matched filter for one point echo. The shape is a constant of the product; the
// width is PingSettings::pulse_width_m unless the pulse was measured (docs/acoustics.md, section 4).
#pragma once

#include <complex>
#include <vector>

namespace sonar {

struct Waveform {
  enum class Shape {
    gaussian,  // exp(-b^2 t^2), Choi 2025 eq. 3; the default
    cw,        // a rectangular tone of length T after its matched filter: a triangle, -3 dB width 0.293 c T
    lfm,       // a linear sweep after compression with a Hamming window: side lobes at -42 dB, -3 dB width 1.30 / sweep
    measured,  // the shape of `samples`
  };
  Shape shape = Shape::gaussian;
  /// For lfm: duration and direction of the sweep. Falling sweeps shift ranges in the opposite direction. Only the Doppler
  /// range shift uses these values.
  float sweep_s = 1e-3f;
  bool falling = false;
  /// For `measured`: complex envelope after the matched filter at sample_rate_hz, with the peak in the middle, at most 65536
  /// samples.
  std::vector<std::complex<float>> samples;
  double sample_rate_hz = 0;
  /// True: synthesises in the frequency domain (exact up to the band limit) instead of using a table of the pulse. `measured`
  /// pulses always do so.
  bool exact = false;
#if __cplusplus >= 202002L  // device code is C++17 and needs no comparison
  bool operator==(const Waveform&) const = default;
#endif
};

}  // namespace sonar
