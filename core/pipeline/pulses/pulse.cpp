#include "core/pipeline/pulses/pulse.hpp"

#include <algorithm>
#include <cmath>

#include "core/pipeline/arithmetic/waveform.hpp"

namespace sonar {
namespace {

using Complex = std::complex<double>;
using Shape = Waveform::Shape;

constexpr double gaussian_reach_widths = 3.99;  // p falls to 2e-10 at this many -3 dB widths
constexpr double gaussian_band_over_b = 2.5;    // P falls to 2e-7 at half of this
constexpr double band_of_tone = 32;             // in 1 / length; beyond it P is at most 4e-4 of the peak, and 1e-3 of p in L2
constexpr double band_of_sweep = 1.5;           // in bandwidths; the fade of p leaves a small part outside
constexpr std::size_t most_samples = 65536;
constexpr double worth_keeping =
    1e-4;  // smaller values of a measured pulse, relative to its peak, are dropped, in time and in frequency
constexpr double finest_rate_per_row = 256;  // samples of a measured pulse per sample of the grid
constexpr double longest_in_rows = 8192;     // longest duration of a measured pulse in sample times of the grid
constexpr int neighbours = 32;               // samples of a measured pulse used for interpolation
constexpr double window_sharpness = 8.6;     // ripple 1e-4 up to 0.8 of the band

double interpolation_weight(double x) {  // x in samples
  const double z = 2 * x / neighbours;
  return std::fabs(z) >= 1 ? 0 : sinc(x) * std::exp(window_sharpness * (std::sqrt(1 - z * z) - 1));
}

double parzen(double x) { return x < 0.5 ? 1 - 6 * x * x * (1 - x) : 2 * (1 - x) * (1 - x) * (1 - x); }

}  // namespace

double sweep_bandwidth_hz(double width_s) { return sweep_width_times_bandwidth / width_s; }

Pulse::Pulse(const Waveform& waveform, double width_s) : shape_(waveform.shape), width_s_(width_s) {
  switch (shape_) {
    case Shape::gaussian:
      // Eq. 22: b [1/s].
      scale_hz_ = 2 * half_power_bt / width_s;
      reach_s_ = gaussian_reach_widths * width_s;
      band_hz_ = gaussian_band_over_b * scale_hz_;
      energy_width_s_ = sonar::energy_width_s(scale_hz_);
      noise_bandwidth_hz_ = sonar::noise_bandwidth_hz(scale_hz_);
      return;
    case Shape::cw:
      // Eq. 23: 1 / T [Hz].
      scale_hz_ = tone_width_per_length / width_s;
      reach_s_ = 1 / scale_hz_;
      band_hz_ = band_of_tone * scale_hz_;
      energy_width_s_ = 2 / (3 * scale_hz_);
      noise_bandwidth_hz_ = 2 * scale_hz_ / 3;
      return;
    case Shape::lfm:
      // Eq. 24: B [Hz].
      scale_hz_ = sweep_bandwidth_hz(width_s);
      reach_s_ = sweep_reach / scale_hz_;
      band_hz_ = band_of_sweep * scale_hz_;
      break;
    case Shape::measured:
      take_samples(waveform);
      break;
  }
  integrate();
}

void Pulse::take_samples(const Waveform& waveform) {
  const std::vector<std::complex<float>>& all = waveform.samples;
  // The peak is in the middle by definition. It becomes p(0) = 1.
  const std::size_t peak = all.size() / 2;
  const Complex top(all[peak]);
  const auto kept = [&](std::size_t i) { return std::abs(Complex(all[i])) >= worth_keeping * std::abs(top); };
  std::size_t first = 0, last = all.size() - 1;
  while (!kept(first)) ++first;
  while (!kept(last)) --last;
  for (std::size_t i = first; i <= last; ++i) samples_.push_back(Complex(all[i]) / top);
  middle_ = static_cast<int>(peak - first);
  scale_hz_ = waveform.sample_rate_hz;
  reach_s_ = (std::max(middle_, static_cast<int>(last - peak)) + neighbours / 2) / scale_hz_;

  // -3 dB points of |p|^2 [s], to a hundredth of a sample.
  const auto half_power = [&](double direction) {
    double t = 0;
    while (std::norm(at(t)) > 0.5) t += direction * 0.01 / scale_hz_;
    return t;
  };
  width_s_ = half_power(1) - half_power(-1);
}

std::complex<double> Pulse::at(double time_s) const {
  switch (shape_) {
    case Shape::gaussian:
      return envelope(scale_hz_, time_s);
    case Shape::cw:
      return tone_envelope(1 / scale_hz_, time_s);
    case Shape::lfm:
      return sweep_envelope(scale_hz_, time_s);
    case Shape::measured:
      break;
  }
  // Interpolates between samples with a windowed sinc (`neighbours`, `window_sharpness`).
  const double place = middle_ + time_s * scale_hz_;
  const int near = static_cast<int>(std::floor(std::clamp(place, -1e9, 1e9)));
  const int from = std::max(near - neighbours / 2 + 1, 0);
  const int to = std::min(near + neighbours / 2, static_cast<int>(samples_.size()) - 1);
  Complex sum;
  for (int k = from; k <= to; ++k) sum += interpolation_weight(place - k) * samples_[static_cast<std::size_t>(k)];
  return sum;
}

std::vector<std::complex<double>> Pulse::spectrum_s(const spectral::FrequencyGrid& grid) const {
  if (shape_ == Shape::gaussian || shape_ == Shape::cw) {
    std::vector<Complex> values;
    for (int m = 0; m < grid.count; ++m) {
      const double nu = grid.first_hz + m * grid.step_hz;
      values.push_back(shape_ == Shape::gaussian ? envelope_spectrum_s(scale_hz_, nu)
                                                 : tone_envelope_spectrum_s(1 / scale_hz_, nu));
    }
    return values;
  }
  // The spectrum is computed from samples, which contain no frequencies above half of their rate.
  const double rate = shape_ == Shape::lfm ? 4 * scale_hz_ : scale_hz_;
  std::vector<spectral::Arrival> arrivals;
  if (shape_ == Shape::lfm)
    for (int k = static_cast<int>(-4 * sweep_reach); k <= static_cast<int>(4 * sweep_reach); ++k)
      arrivals.push_back({k / rate, at(k / rate) / rate});
  else
    for (int k = 0; k < static_cast<int>(samples_.size()); ++k)
      arrivals.push_back({(k - middle_) / rate, samples_[static_cast<std::size_t>(k)] / rate});
  constexpr int width = 10;  // errors of 1e-9
  std::vector<Complex> values =
      spectral::have_transform ? spectral::fast_sum(arrivals, grid, width) : spectral::direct_sum(arrivals, grid);
  for (int m = 0; m < grid.count; ++m)
    if (std::abs(grid.first_hz + m * grid.step_hz) > 0.5 * rate) values[static_cast<std::size_t>(m)] = 0;
  return values;
}

/// Computes the values that have no formula, from samples in time and in frequency.
void Pulse::integrate() {
  const double rate = shape_ == Shape::lfm ? 4 * scale_hz_ : scale_hz_;
  // tau_eff = integral of |p|^2 dt [s].
  energy_width_s_ = 0;
  const int reach = static_cast<int>(std::ceil(reach_s_ * rate));
  for (int k = -reach; k <= reach; ++k) energy_width_s_ += std::norm(at(k / rate)) / rate;
  const int count = spectral::quick_size(4 * reach + 2);
  const spectral::FrequencyGrid grid{-0.5 * rate, rate / count, count};
  const std::vector<Complex> spectrum = spectrum_s(grid);
  double highest = 0;
  for (const Complex& v : spectrum) highest = std::max(highest, std::abs(v));
  // B_n [Hz]. By Parseval's theorem the integral of |P|^2 is tau_eff.
  noise_bandwidth_hz_ = energy_width_s_ / (highest * highest);
  if (shape_ != Shape::measured) return;
  band_hz_ = 0;
  for (int m = 0; m < count; ++m)
    if (std::abs(spectrum[static_cast<std::size_t>(m)]) >= worth_keeping * highest)
      band_hz_ = std::max(band_hz_, 2 * std::abs(grid.first_hz + m * grid.step_hz));
}

std::complex<double> Pulse::correlation(double time_s) const {
  if (shape_ == Shape::gaussian) return noise_correlation(scale_hz_, time_s);
  if (shape_ == Shape::cw) {  // the correlation of a triangle is a cubic spline
    const double x = std::fabs(time_s) * scale_hz_;
    return x < 1 ? 1 - 1.5 * x * x + 0.75 * x * x * x : x < 2 ? 0.25 * (2 - x) * (2 - x) * (2 - x) : 0.0;
  }
  Complex sum;
  if (shape_ == Shape::lfm) {
    const double rate = 4 * scale_hz_;
    const int reach = static_cast<int>(std::ceil(reach_s_ * rate));
    for (int k = -reach; k <= reach; ++k) sum += at(k / rate) * std::conj(at(k / rate - time_s));
    return sum / rate / energy_width_s_;
  }
  // In the shifted pulse all samples have the same distance to their neighbours. Therefore one set of weights is enough.
  const double shift = time_s * scale_hz_;
  const int whole = static_cast<int>(std::floor(std::clamp(shift, -1e6, 1e6))), count = static_cast<int>(samples_.size());
  for (int j = -neighbours / 2 + 1; j <= neighbours / 2; ++j) {
    const double weight = interpolation_weight(j - (shift - whole));
    for (int k = std::max(0, whole + j); k < std::min(count, count + whole + j); ++k)
      sum += weight * samples_[static_cast<std::size_t>(k)] * std::conj(samples_[static_cast<std::size_t>(k - whole - j)]);
  }
  return sum / scale_hz_ / energy_width_s_;
}

std::string why_invalid(const Waveform& w, double sample_time_s) {
  if ((w.shape == Shape::measured || w.exact) && !spectral::have_transform) return spectral::no_transform;
  if (!(w.sweep_s > 0) || !std::isfinite(w.sweep_s)) return "the waveform's sweep time must be positive and finite";
  if (w.shape != Shape::measured) return {};
  if (w.samples.size() < 3 || w.samples.size() > most_samples)
    return "a measured pulse has 3 to " + std::to_string(most_samples) + " samples, not " + std::to_string(w.samples.size());
  if (!(w.sample_rate_hz > 0) || !std::isfinite(w.sample_rate_hz))
    return "a measured pulse needs its sample rate, positive and finite";
  if (w.sample_rate_hz * sample_time_s > finest_rate_per_row)
    return "the measured pulse has more than " + std::to_string(static_cast<int>(finest_rate_per_row)) +
           " samples per sample of the picture: resample it to a few times its bandwidth";
  if (static_cast<double>(w.samples.size()) / w.sample_rate_hz > longest_in_rows * sample_time_s)
    return "the measured pulse is longer than " + std::to_string(static_cast<int>(longest_in_rows)) +
           " samples of the picture: cut off the part after its decay";
  const float top = std::abs(w.samples[w.samples.size() / 2]);
  for (const std::complex<float>& s : w.samples)
    if (!std::isfinite(s.real()) || !std::isfinite(s.imag()) || std::abs(s) > top || !(top > 0))
      return "a measured pulse must be finite and have its peak in the middle, at sample " + std::to_string(w.samples.size() / 2);
  return {};
}

int taps_of(const Pulse& pulse, double sample_time_s) {
  // A Gaussian ends well before the last tap. Therefore up to a twentieth of a group of eight taps may be missing.
  const double slack = pulse.shape() == Shape::gaussian ? 0.05 : 0;
  return 8 * std::max(1, static_cast<int>(std::ceil(2 * pulse.reach_s() / sample_time_s / 8 - slack)));
}

std::vector<float> make_pulse_rows(const Pulse& pulse, double sample_time_s, int taps, int steps, bool squared) {
  const auto value = [&](int step, int tap) {
    const Complex p = pulse.at(sample_time_s * (tap - (taps / 2 - 1) - static_cast<double>(step) / steps));
    return squared ? std::norm(p) : p.real();
  };
  std::vector<float> rows;
  std::vector<double> now, next;
  for (int tap = 0; tap < taps; ++tap) next.push_back(value(0, tap));
  for (int step = 0; step <= steps; ++step) {  // one more than steps, because a fraction may be rounded up to a whole
    now = next;
    for (int tap = 0; tap < taps; ++tap) next[static_cast<std::size_t>(tap)] = value(step + 1, tap);
    for (const double v : now) rows.push_back(static_cast<float>(v));
    for (std::size_t tap = 0; tap < now.size(); ++tap) rows.push_back(static_cast<float>(next[tap] - now[tap]));
  }
  return rows;
}

std::vector<float> make_noise_filter(const Pulse& pulse, double sample_time_s) {
  constexpr int longest = 160;
  constexpr double gaussian_correlation_reach_bt = 6.1;  // the correlation falls to 1e-8 there
  const double reach_s = pulse.shape() == Shape::gaussian ? gaussian_correlation_reach_bt * pulse.width_s() / (2 * half_power_bt)
                                                          : 2 * pulse.reach_s();
  const int wanted = static_cast<int>(std::min(std::max(std::ceil(reach_s / sample_time_s), 2.0), 1e6));
  const int order = std::min(wanted, longest);
  std::vector<double> r(static_cast<std::size_t>(order) + 1);
  for (int k = 0; k <= order; ++k) {
    // A truncated correlation is not a valid correlation. It becomes valid by multiplication with a window that is itself a
    // correlation.
    const double window = wanted > longest ? parzen(static_cast<double>(k) / (order + 1)) : 1.0;
    r[static_cast<std::size_t>(k)] = window * pulse.correlation(k * sample_time_s).real();
  }
  r[0] += 1e-5;  // keeps the factorisation definite on fine grids, where the spectrum falls to 0
  // Bauer's method: the rows of the Cholesky factor of the long banded Toeplitz matrix tend to the minimum-phase factor.
  const int n = 12 * order + 64;
  std::vector<std::vector<double>> band(static_cast<std::size_t>(n), std::vector<double>(static_cast<std::size_t>(order) + 1));
  const auto l = [&](int i, int j) -> double& { return band[static_cast<std::size_t>(i)][static_cast<std::size_t>(i - j)]; };
  for (int i = 0; i < n; ++i)
    for (int j = std::max(0, i - order); j <= i; ++j) {
      double sum = r[static_cast<std::size_t>(i - j)];
      for (int k = std::max(0, i - order); k < j; ++k) sum -= l(i, k) * l(j, k);
      l(i, j) = i == j ? std::sqrt(std::max(sum, 1e-12)) : sum / l(j, j);
    }
  std::vector<float> h;
  double energy = 0;
  for (const double v : band.back()) energy += v * v;
  for (const double v : band.back()) h.push_back(static_cast<float>(v / std::sqrt(energy)));
  return h;
}

}  // namespace sonar
