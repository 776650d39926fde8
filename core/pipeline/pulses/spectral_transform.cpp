#include "core/pipeline/pulses/spectral_transform.hpp"

#include <cassert>

#if SONAR_HAVE_FFTW
#include <fftw3.h>

#include <mutex>
#endif

namespace sonar::spectral {

#if SONAR_HAVE_FFTW

namespace {

// The whole process has one planner of FFTW, which only one thread may use at a time. Plans may be executed by several threads.
std::mutex& planner() {
  static std::mutex only;
  return only;
}

fftw_complex* as_fftw(Complex* values) { return reinterpret_cast<fftw_complex*>(values); }  // FFTW promises the same layout

}  // namespace

const bool have_transform = true;

struct Fft::Plan {
  Plan(int size, int sign) {
    const std::lock_guard<std::mutex> alone(planner());
    // Estimated plans do not change the array and are the same in every run. Plans for unaligned arrays can be used for any
    // array.
    Complex nothing;
    plan = fftw_plan_dft_1d(size, as_fftw(&nothing), as_fftw(&nothing), sign, FFTW_ESTIMATE | FFTW_UNALIGNED);
    assert(plan != nullptr);
  }
  Plan(const Plan&) = delete;
  Plan& operator=(const Plan&) = delete;
  ~Plan() {
    const std::lock_guard<std::mutex> alone(planner());
    fftw_destroy_plan(plan);
  }
  fftw_plan plan;
};

Fft::Fft(int size, Direction direction)
    : size_(size), plan_(std::make_shared<const Plan>(size, direction == Direction::forward ? FFTW_FORWARD : FFTW_BACKWARD)) {}

void Fft::run(Complex* values) const { fftw_execute_dft(plan_->plan, as_fftw(values), as_fftw(values)); }

#else

const bool have_transform = false;

// why_invalid(Waveform) rejects pulses that need a transform.
struct Fft::Plan {};

Fft::Fft(int size, Direction) : size_(size) { assert(have_transform); }

void Fft::run(Complex*) const { assert(have_transform); }

#endif

int quick_size(int n) {
  // The size is even, because FrequencySums counts frequencies from the middle. It has small factors, because FFTW is fast for
  // them.
  for (int size = n + n % 2;; size += 2) {
    int rest = size;
    for (const int factor : {2, 3, 5, 7})
      while (rest % factor == 0) rest /= factor;
    if (rest == 1) return size;
  }
}

}  // namespace sonar::spectral
