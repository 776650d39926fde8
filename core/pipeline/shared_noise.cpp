#include "core/pipeline/shared_noise.hpp"

#include <algorithm>
#include <cmath>

#include "core/pipeline/arithmetic/kernel_math.hpp"
#include "core/pipeline/arithmetic/noise_place.hpp"
#include "core/pipeline/interference.hpp"
#include "core/pipeline/ping_plan.hpp"

namespace sonar {
namespace {

constexpr double none_db = -150;
constexpr double margin = 2;  // how far beyond the range where the streaks leave the sector their edge is followed

/// Adding and subtracting it leaves a whole number.
constexpr float whole = 12582912;

/// sin(2 pi x), |x| up to a half.
float sine_near_0(float x) {
  const float folded = (x > 0 ? 0.5f : -0.5f) - x;
  return sine_of_quarter(std::fabs(x) > 0.25f ? folded : x);
}

/// Complex [beams]: sum over the channels of (-1)^m e^{i 2 pi d / lambda}, d the delay of a channel at x against the array's
/// middle, from a point at `range_m` and sine u.
class FocusedArray {
 public:
  FocusedArray(const std::vector<double>& beam_sines, int channels, double spacing_in_wavelengths)
      : u_(beam_sines.begin(), beam_sines.end()),
        re_(u_.size()),
        im_(u_.size()),
        channels_(channels),
        d_(spacing_in_wavelengths) {}
  void focus(double range_in_wavelengths) {
    std::fill(re_.begin(), re_.end(), 0.0f);
    std::fill(im_.begin(), im_.end(), 0.0f);
    const auto r = static_cast<float>(range_in_wavelengths);
    for (int m = 0; m < channels_; ++m) {
      const auto x = static_cast<float>((m - 0.5 * (channels_ - 1)) * d_);
      const float sign = m % 2 == 0 ? 1.0f : -1.0f;
      for (std::size_t j = 0; j < u_.size(); ++j) {
        const float beyond = x * (x - 2 * r * u_[j]), delay = beyond / (std::sqrt(r * r + beyond) + r);
        const float turns = delay - ((delay + whole) - whole);
        re_[j] += sign * sine_near_0(0.25f - std::fabs(turns));
        im_[j] += sign * sine_near_0(turns);
      }
    }
  }
  float re(std::size_t beam) const { return re_[beam]; }
  float im(std::size_t beam) const { return im_[beam]; }

 private:
  std::vector<float> u_, re_, im_;
  int channels_;
  double d_;
};

}  // namespace

/// Eq. 47.
SharedNoiseTable::SharedNoiseTable(const PingPlan& plan) {
  const SharedNoise& law = plan.mode.receiver.shared_noise;
  const bool noise = static_cast<double>(law.level_db) > none_db;
  const Leak leak = plan.mode.receiver.leak_is_shared ? Leak(plan, plan.switches) : Leak();
  if (!plan.switches.shared_noise || !(noise || leak.is_audible()) || law.channels < 2) return;
  const double wavelength_m =
      static_cast<double>(plan.settings.device_sound_speed_mps) / static_cast<double>(plan.mode.centre_hz);
  const double sine = static_cast<double>(law.sine), spacing_m = wavelength_m / (2 * sine);
  const std::size_t beams = plan.beam_sine.size();
  double widest = 0;
  for (const double u : plan.beam_sine) widest = std::max(widest, std::abs(u));
  const double outside = sine - widest;
  const double until_m =
      outside > 0 ? margin * (1 - sine * sine) * law.channels / 2 * spacing_m / outside : plan.settings.range_m;
  const auto range_m = [&](int n) { return (n + plan.sample_offset) * plan.sample_spacing_m; };
  const auto leak_samples = static_cast<int>(leak.rms_upa().size());
  while (samples_ < plan.samples && ((noise && range_m(samples_) < until_m) || samples_ < leak_samples)) ++samples_;
  // A channel's own noise, by itself, is (30) at a beam's output.
  const double own_upa = plan.column_noise_upa * std::sqrt(plan.beam_weights.weight_energy / law.channels);
  const double changing = 1 - static_cast<double>(law.steady);
  const double level_upa = noise ? own_upa * amplitude_from_db(static_cast<double>(law.level_db)) * std::sqrt(changing) : 0;
  steady_ = static_cast<float>(std::sqrt(static_cast<double>(law.steady) / changing));
  const double focus_m = static_cast<double>(law.focus_rows) * plan.settings.samples_per_row * plan.sample_spacing_m;
  const double nearest_m = std::max(static_cast<double>(law.nearest_focus_m), plan.sample_spacing_m / 2);
  response_.resize(2 * beams * static_cast<std::size_t>(samples_));
  FocusedArray array(plan.beam_sine, law.channels, spacing_m / wavelength_m);
  for (int n = 0; n < samples_; ++n) {
    array.focus(std::max(range_m(n) + focus_m, nearest_m) / wavelength_m);
    double power = 0;
    for (std::size_t j = 0; j < beams; ++j) {
      float* to = response_.data() + 2 * (j * static_cast<std::size_t>(samples_) + static_cast<std::size_t>(n));
      to[0] = array.re(j);
      to[1] = array.im(j);
      power += static_cast<double>(to[0] * to[0] + to[1] * to[1]);
    }
    const double r = std::max(range_m(n), plan.sample_spacing_m / 2);
    noise_upa_.push_back(static_cast<float>(level_upa * std::sqrt(std::min(1.0, r / static_cast<double>(law.full_m)))));
    // (31) at the beams' outputs, as a mean over them.
    if (n < leak_samples)
      leak_.push_back(static_cast<float>(Leak::steady_part * static_cast<double>(leak.rms_upa()[static_cast<std::size_t>(n)]) *
                                         std::sqrt(plan.beam_weights.weight_energy * static_cast<double>(beams) / power)));
  }
}

double SharedNoiseTable::noise_power(std::size_t beam, std::size_t sample) const {
  if (sample >= static_cast<std::size_t>(samples_)) return 0;
  const float* r = response_.data() + 2 * (beam * static_cast<std::size_t>(samples_) + sample);
  return static_cast<double>((r[0] * r[0] + r[1] * r[1]) * noise_upa_[sample] * noise_upa_[sample] * (1 + steady_ * steady_));
}

void SharedNoiseTable::draw(const PingNoise& key, bool noise, bool blank, std::vector<float>& shared) const {
  shared.assign(2 * static_cast<std::size_t>(samples_), 0.0f);
  if (noise) key.table->set(key.sonar, key.ping, static_cast<int>(shared_noise_column), 1, samples_, shared.data());
  for (std::size_t n = 0; n < noise_upa_.size(); ++n) {
    shared[2 * n] = noise_upa_[n] * (shared[2 * n] + (noise ? steady_ : 0));
    shared[2 * n + 1] *= noise_upa_[n];
  }
  for (std::size_t n = 0; n < leak_.size() && !blank; ++n) shared[2 * n] += leak_[n];
}

void SharedNoiseTable::draw_power(bool noise, bool blank, std::vector<float>& shared) const {
  shared.assign(2 * static_cast<std::size_t>(samples_), 0.0f);
  for (std::size_t n = 0; n < noise_upa_.size() && noise; ++n)
    shared[2 * n] = noise_upa_[n] * noise_upa_[n] * (1 + steady_ * steady_);
  for (std::size_t n = 0; n < leak_.size() && !blank; ++n) shared[2 * n] += leak_[n] * leak_[n];
}

void SharedNoiseTable::add(const std::vector<float>& shared, bool expected_power, BeamSignals& beams) const {
  const int count = std::min(beams.samples, samples_ - beams.first_sample);
  for (int j = 0; j < beams.beams && count > 0; ++j) {
    const float* __restrict r = response_.data() + 2 * (static_cast<std::ptrdiff_t>(j) * samples_ + beams.first_sample);
    const float* __restrict c = shared.data() + 2 * static_cast<std::ptrdiff_t>(beams.first_sample);
    float* __restrict to = beams.beam(j);
    if (expected_power) {
      for (int n = 0; n < count; ++n) to[2 * n] += c[2 * n] * (r[2 * n] * r[2 * n] + r[2 * n + 1] * r[2 * n + 1]);
      continue;
    }
    for (int n = 0; n < count; ++n) {
      to[2 * n] += c[2 * n] * r[2 * n] - c[2 * n + 1] * r[2 * n + 1];
      to[2 * n + 1] += c[2 * n] * r[2 * n + 1] + c[2 * n + 1] * r[2 * n];
    }
  }
}

}  // namespace sonar
