#include "core/paper/paper_signal.hpp"

#include <algorithm>
#include <cmath>

namespace sonar::paper {
namespace {

using spectral::Complex;
using spectral::turned;

// Number of steps between samples at which the power of a pulse is tabulated. Long records have fewer steps, to limit the
// memory.
constexpr std::size_t largest_power_table = std::size_t{1} << 22;  // values
constexpr int most_steps = 64;

}  // namespace

PaperSpectrum make_spectrum(const PingPlan& plan) {
  PaperSpectrum s;
  s.samples = plan.samples;
  s.sample_offset = plan.sample_offset - plan.start_samples;
  // The length T [s] of the record, in two-way travel time.
  const double record_s = plan.samples * 2 * plan.sample_spacing_m / static_cast<double>(plan.settings.device_sound_speed_mps);
  // Choi 2025, eq. 4: df = 1 / T, M = b T frequencies about the carrier.
  const double band = plan.envelope_hz * record_s;                  // b T, in units of df
  s.count = std::max(1, static_cast<int>(std::ceil(band - 1e-3)));  // rounding may make b T slightly larger than a whole number
  s.first_frequency = 1 - 0.5 * band;                               // f_min = f_c - b / 2, m from 1
  double sum = 0;
  for (int m = 0; m < s.count; ++m) {
    const double x = pi * (s.first_frequency + m) / band;  // (f - f_c) pi / b
    // Choi 2025, eq. 3: |S(f)| = e^{-(pi (f - f_c) / b)^2}, normalised to sum 1.
    s.weight.push_back(std::exp(-x * x));
    sum += s.weight.back();
  }
  for (double& w : s.weight) w /= sum;
  return s;
}

void PaperEchoes::push_back(const PaperEcho& e) {
  turns.push_back(e.turns);
  re.push_back(e.amplitude.real());
  im.push_back(e.amplitude.imag());
}

void sum_frequencies(const PaperEchoes& echoes, const PaperSpectrum& spectrum, const spectral::FrequencySums* fast,
                     const simd::Kernels& kernels, SumScratch& scratch, std::span<std::complex<float>> out) {
  std::vector<Complex>& sums = scratch.sums;
  // The sum of eq. 1 over scatterers at every frequency, with a non-uniform transform or term by term.
  if (fast) {
    sums.resize(static_cast<std::size_t>(spectrum.count));
    scratch.grid.assign(static_cast<std::size_t>(fast->grid_points() + fast->padding), 0.0);
    // FrequencySums counts from the middle frequency. The amplitudes already contain the carriers.
    const double middle = spectrum.first_frequency + spectrum.count / 2;
    fast->add(echoes.turns, echoes.re, echoes.im, middle, kernels, scratch.grid.data());
    fast->transform(scratch.grid.data(), sums.data());
  } else {
    std::vector<spectral::Arrival> arrivals;
    for (std::size_t i = 0; i < echoes.size(); ++i) arrivals.push_back({echoes[i].turns, echoes[i].amplitude});
    sums = spectral::direct_sum(arrivals, {spectrum.first_frequency, 1.0, spectrum.count});
  }
  for (std::size_t m = 0; m < sums.size(); ++m) out[m] = std::complex<float>(spectrum.weight[m] * sums[m]);
}

std::vector<float> make_correction(std::span<const double> azimuth_rad, double spacing_rad, bool squared) {
  std::vector<double> v;
  double energy = 0;
  for (const double to : azimuth_rad)
    for (const double from : azimuth_rad) {
      // The weights as in the authors' code: |sin y / y| for the angle between two beams, normalised by the energy of all
      // weights.
      const double y = pi * 0.884 / spacing_rad * std::sin(to - from);
      v.push_back(std::abs(y) < 1e-12 ? 1.0 : std::abs(std::sin(y) / y));
      energy += v.back() * v.back();
    }
  std::vector<float> weights;
  weights.reserve(v.size());
  for (const double x : v) weights.push_back(static_cast<float>(squared ? x * x / energy : x / std::sqrt(energy)));
  return weights;
}

std::unique_ptr<BeamTransformTables> even_correction(std::span<const double> azimuth_rad, double spacing_rad) {
  const std::size_t n = azimuth_rad.size();
  if (n < 2) return nullptr;
  // Azimuths must be uniform to 1e-9 rad. Otherwise the correction is not a convolution.
  const double step = (azimuth_rad.back() - azimuth_rad.front()) / static_cast<double>(n - 1);
  std::vector<double> v;
  double energy = 0;
  for (std::size_t d = 0; d < n; ++d) {
    if (std::abs(azimuth_rad[d] - azimuth_rad[0] - static_cast<double>(d) * step) > 1e-9) return nullptr;
    // This is the weight of make_correction(). Among n azimuths, n - d pairs are d apart in each direction.
    const double y = pi * 0.884 / spacing_rad * std::sin(static_cast<double>(d) * step);
    v.push_back(d == 0 ? 1.0 : std::abs(std::sin(y) / y));
    energy += v.back() * v.back() * static_cast<double>(n - d) * (d == 0 ? 1 : 2);
  }
  for (double& x : v) x /= std::sqrt(energy);
  return std::make_unique<BeamTransformTables>(v);
}

void correct(const BeamTransformTables& even, std::span<const float> in, int values, const simd::Kernels& kernels, Parallel& pool,
             std::span<float> out) {
  constexpr int block = 32;
  std::vector<AlignedFloats> work(static_cast<std::size_t>(pool.threads()), AlignedFloats(even.work_floats()));
  // Each value is corrected separately, so that sums do not depend on the number of threads.
  pool.for_each(static_cast<std::size_t>(values / block), [&](std::size_t b, int worker) {
    kernels.transform_beams(even.tables(), in.data() + b * block, values, block, work[static_cast<std::size_t>(worker)].data(),
                            out.data() + b * block, values);
  });
}

std::vector<float> panels_of(std::span<const float> weights, int beams, int columns) {
  const auto b = static_cast<std::size_t>(beams), c = static_cast<std::size_t>(columns);
  std::vector<float> panels((b + 3) / 4 * 4 * c, 0.0f);
  for (std::size_t j = 0; j < b; ++j)
    for (std::size_t k = 0; k < c; ++k) panels[(j / 4 * c + k) * 4 + j % 4] = weights[j * c + k];
  return panels;
}

void correct(std::span<const float> panels, int beams, int columns, std::span<const float> in, int values,
             const simd::Kernels& kernels, Parallel& pool, std::span<float> out) {
  constexpr int block = 128;  // number of values of a block: a block of all columns stays in the second-level cache
  const auto length = static_cast<std::size_t>(values), count = static_cast<std::size_t>(columns);
  std::vector<std::vector<float>> windows(static_cast<std::size_t>(pool.threads()));
  pool.for_each((length + block - 1) / block, [&](std::size_t b, int worker) {
    const std::size_t from = b * block, n = std::min<std::size_t>(block, length - from);
    std::vector<float>& window = windows[static_cast<std::size_t>(worker)];
    window.assign(count * block, 0.0f);
    for (std::size_t k = 0; k < count; ++k) std::copy_n(in.data() + k * length + from, n, window.data() + k * block);
    for (int j = 0; j < beams; j += 4) {
      float sums[4 * block];
      kernels.form_beam_panel(window.data(), block, panels.data() + static_cast<std::size_t>(j) * count, columns, sums, block);
      for (int i = 0; i < 4 && j + i < beams; ++i)
        std::copy_n(sums + i * block, n, out.data() + static_cast<std::size_t>(j + i) * length + from);
    }
  });
}

InverseTransform::InverseTransform(const PaperSpectrum& spectrum) : grid_(spectrum) {
  const double samples = spectrum.samples;
  if (spectral::have_transform) inverse_ = std::make_unique<spectral::Fft>(spectrum.samples, spectral::Fft::Direction::inverse);
  // t_0: sample 0 lies sample_offset after the record's beginning.
  for (int m = 0; m < spectrum.count; ++m)
    half_turn_.push_back(turned((spectrum.first_frequency + m) * spectrum.sample_offset / samples));
  for (int n = 0; n < spectrum.samples; ++n) {
    root_.push_back(turned(n / samples));
    baseband_.push_back(turned(n * spectrum.first_frequency / samples));
  }
}

void InverseTransform::run(std::span<const std::complex<float>> spectrum, std::vector<Complex>& work, float* out) const {
  // Frequencies that differ by a multiple of the sample rate have the same samples. Therefore they share an element.
  const auto n = static_cast<std::size_t>(grid_.samples);
  work.assign(n, {});
  for (std::size_t m = 0; m < spectrum.size(); ++m) work[m % n] += Complex(spectrum[m]) * half_turn_[m];
  if (inverse_) {
    inverse_->run(work.data());
  } else {
    std::vector<Complex> sums(n);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t m = 0; m < n; ++m) sums[i] += work[m] * root_[i * m % n];
    work.swap(sums);
  }
  // The transform counts frequencies from 0. The factor e^{i 2 pi f_1 t_n} shifts them to f_1.
  for (std::size_t i = 0; i < n; ++i) {
    const Complex s = work[i] * baseband_[i];
    out[2 * i] = static_cast<float>(s.real()), out[2 * i + 1] = static_cast<float>(s.imag());
  }
}

PulsePower::PulsePower(const PaperSpectrum& spectrum, const InverseTransform& inverse)
    : samples_(spectrum.samples), offset_(spectrum.sample_offset) {
  const auto n = static_cast<std::size_t>(samples_);
  steps_ = static_cast<int>(std::clamp<std::size_t>(largest_power_table / n, 1, most_steps));
  std::vector<std::complex<float>> lone(static_cast<std::size_t>(spectrum.count));
  std::vector<Complex> work;
  std::vector<float> signal(2 * n);
  SumScratch scratch;
  for (int step = 0; step <= steps_; ++step) {  // the echo lies step / steps of a sample after sample 0
    PaperEchoes echo;
    echo.push_back({(offset_ + static_cast<double>(step) / steps_) / samples_, {1, 0}});
    sum_frequencies(echo, spectrum, nullptr, simd::kernels_for(SimdLevel::automatic), scratch, lone);
    inverse.run(lone, work, signal.data());
    for (std::size_t i = 0; i < n; ++i) table_.push_back(signal[2 * i] * signal[2 * i] + signal[2 * i + 1] * signal[2 * i + 1]);
  }
}

void PulsePower::add(const PaperEcho& echo, std::span<float> power) const {
  const double place = echo.turns * samples_ - offset_, whole = std::floor(place);
  const auto step = std::min(static_cast<std::size_t>((place - whole) * steps_ + 0.5), static_cast<std::size_t>(steps_));
  const float* pulse = table_.data() + step * static_cast<std::size_t>(samples_);
  const auto scale = static_cast<float>(echo.amplitude.real());
  const auto shift = static_cast<std::size_t>(((static_cast<int>(whole) % samples_) + samples_) % samples_);
  const std::size_t n = power.size();  // the record is periodic: a pulse that extends beyond its end continues at its beginning
  for (std::size_t i = shift; i < n; ++i) power[i] += scale * pulse[i - shift];
  for (std::size_t i = 0; i < shift; ++i) power[i] += scale * pulse[n - shift + i];
}

}  // namespace sonar::paper
