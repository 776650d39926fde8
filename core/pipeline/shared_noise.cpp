#include "core/pipeline/shared_noise.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "core/pipeline/arithmetic/noise_place.hpp"
#include "core/pipeline/ping_plan.hpp"

namespace sonar {
namespace {

constexpr double none_db = -150;
constexpr double margin = 2;  // how far beyond the range where the streaks leave the sector their edge is followed

}  // namespace

/// Eq. 47. Channels lie at x = +-(m + 1/2) d; those at +x and -x have opposite signs, so that their sum is a sine.
SharedNoiseTable::SharedNoiseTable(const PingPlan& plan) {
  const SharedNoise& law = plan.mode.receiver.shared_noise;
  if (!plan.switches.shared_noise || !(static_cast<double>(law.level_db) > none_db) || law.channels < 2) return;
  const double wavelength_m =
      static_cast<double>(plan.settings.device_sound_speed_mps) / static_cast<double>(plan.mode.centre_hz);
  const double sine = static_cast<double>(law.sine), spacing_m = wavelength_m / (2 * sine), oblique = 1 - sine * sine;
  const int half = law.channels / 2;
  const auto beams = static_cast<int>(plan.beam_sine.size());
  double widest = 0;
  for (const double u : plan.beam_sine) widest = std::max(widest, std::abs(u));
  const double outside = sine - widest;
  const double until_m = outside > 0 ? margin * oblique * half * spacing_m / outside : plan.settings.range_m;
  const auto range_m = [&](int n) { return (n + plan.sample_offset) * plan.sample_spacing_m; };
  while (samples_ < plan.samples && range_m(samples_) < until_m) ++samples_;
  std::vector<float> sines;  // [channels][beams]
  for (int m = 0; m < half; ++m)
    for (const double u : plan.beam_sine)
      sines.push_back(static_cast<float>((m % 2 == 0 ? 2 : -2) * std::sin(2 * pi * (m + 0.5) * spacing_m * u / wavelength_m)));
  // A channel's own noise, by itself, is (30) at a beam's output.
  const double own_upa = plan.column_noise_upa * std::sqrt(plan.beam_weights.weight_energy / (2.0 * half));
  const double level_upa = own_upa * amplitude_from_db(static_cast<double>(law.level_db));
  response_.resize(2 * static_cast<std::size_t>(beams) * static_cast<std::size_t>(samples_));
  std::vector<float> re(static_cast<std::size_t>(beams)), im(static_cast<std::size_t>(beams));
  for (int n = 0; n < samples_; ++n) {
    const double r = std::max(range_m(n), plan.sample_spacing_m / 2);
    const double rms = level_upa * std::sqrt(std::min(1.0, r / static_cast<double>(law.full_m)));
    std::fill(re.begin(), re.end(), 0.0f);
    std::fill(im.begin(), im.end(), 0.0f);
    for (int m = 0; m < half; ++m) {
      const double x = (m + 0.5) * spacing_m;
      const auto turned = std::complex<float>(std::polar(rms, pi * oblique * x * x / (wavelength_m * r)));
      const float* __restrict s = sines.data() + static_cast<std::ptrdiff_t>(m) * beams;
      for (int j = 0; j < beams; ++j) {
        re[static_cast<std::size_t>(j)] += turned.real() * s[j];
        im[static_cast<std::size_t>(j)] += turned.imag() * s[j];
      }
    }
    for (int j = 0; j < beams; ++j) {
      float* to = response_.data() + 2 * (static_cast<std::ptrdiff_t>(j) * samples_ + n);
      to[0] = re[static_cast<std::size_t>(j)];
      to[1] = im[static_cast<std::size_t>(j)];
    }
  }
}

void SharedNoiseTable::draw(const PingNoise& noise, std::vector<float>& draws) const {
  draws.resize(2 * static_cast<std::size_t>(samples_));
  noise.table->set(noise.sonar, noise.ping, static_cast<int>(shared_noise_column), 1, samples_, draws.data());
}

void SharedNoiseTable::add(const std::vector<float>& draws, bool expected_power, BeamSignals& beams) const {
  const int count = std::min(beams.samples, samples_ - beams.first_sample);
  for (int j = 0; j < beams.beams && count > 0; ++j) {
    const float* __restrict r = response_.data() + 2 * (static_cast<std::ptrdiff_t>(j) * samples_ + beams.first_sample);
    float* __restrict to = beams.beam(j);
    if (expected_power) {
      for (int n = 0; n < count; ++n) to[2 * n] += r[2 * n] * r[2 * n] + r[2 * n + 1] * r[2 * n + 1];
      continue;
    }
    const float* __restrict c = draws.data() + 2 * static_cast<std::ptrdiff_t>(beams.first_sample);
    for (int n = 0; n < count; ++n) {
      to[2 * n] += c[2 * n] * r[2 * n] - c[2 * n + 1] * r[2 * n + 1];
      to[2 * n + 1] += c[2 * n] * r[2 * n + 1] + c[2 * n + 1] * r[2 * n];
    }
  }
}

}  // namespace sonar
