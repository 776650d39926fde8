// The discrete Fourier transform of the frequency-domain path (docs/acoustics.md, section 4): one class, which calls FFTW. Its
// .cpp is the only file that includes FFTW. In a build without FFTW (SONAR_FFTW=OFF), have_transform is false.
#pragma once

#include <complex>
#include <memory>

namespace sonar::spectral {

using Complex = std::complex<double>;

/// True if this build has a transform. If it is false, Fft must not be constructed.
extern const bool have_transform;
/// The error text of a build without a transform: the reason and the remedy.
inline constexpr const char* no_transform =
    "this build has no Fourier transform: measured and exact pulses need one; install libfftw3-dev and build with SONAR_FFTW=ON";

/// x[k] = sum_n x[n] e^{-+ i 2 pi k n / size}, in place, not scaled. Any number of threads may use one object. The result
/// depends only on the input, because plans are estimated and never measured.
class Fft {
 public:
  enum class Direction { forward, inverse };  // e^{-i ...}, e^{+i ...}
  Fft(int size, Direction direction);
  int size() const { return size_; }
  void run(Complex* values) const;

 private:
  struct Plan;
  int size_;
  std::shared_ptr<const Plan> plan_;
};

/// The smallest even size of at least n without prime factors above 7.
int quick_size(int n);

}  // namespace sonar::spectral
