// Pulses of all shapes for tests. The measured one also exists as a formula.
#pragma once

#include <cmath>
#include <complex>
#include <string>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "core/sonar/sonar_model.hpp"

namespace sonar::test {

inline constexpr double measured_b_hz = 30e3;

/// Returns an asymmetric complex pulse like that of a real receiver: a Gaussian with a residual sweep, plus a delayed, weaker
/// copy with another phase. The peak is p(0) = 1 within a part in 1e7.
inline std::complex<double> measured_envelope(double time_s) {
  const double x = measured_b_hz * time_s, late = x - 4;
  return std::polar(std::exp(-x * x), 0.7 * x * x) + std::polar(0.1 * std::exp(-late * late), 1.0);
}

inline Waveform waveform_of(Waveform::Shape shape) {
  Waveform w;
  w.shape = shape;
  if (shape != Waveform::Shape::measured) return w;
  w.sample_rate_hz = 8 * measured_b_hz;
  for (int k = -80; k <= 80; ++k)
    w.samples.emplace_back(std::complex<float>(2.5f * std::complex<float>(measured_envelope(k / w.sample_rate_hz))));
  return w;
}

inline std::string name_of(Waveform::Shape shape) {
  const char* names[] = {"Gaussian", "tone", "sweep", "measured pulse"};
  return names[static_cast<int>(shape)];
}

inline const std::vector<Waveform::Shape>& all_shapes() {
  static const std::vector<Waveform::Shape> shapes = {Waveform::Shape::gaussian, Waveform::Shape::cw, Waveform::Shape::lfm,
                                                      Waveform::Shape::measured};
  return shapes;
}

}  // namespace sonar::test
