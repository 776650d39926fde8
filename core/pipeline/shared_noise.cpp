#include "core/pipeline/shared_noise.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdlib>
#include <limits>
#include <string>

#include "core/pipeline/arithmetic/kernel_math.hpp"
#include "core/pipeline/arithmetic/noise_place.hpp"
#include "core/pipeline/interference.hpp"
#include "core/pipeline/ping_plan.hpp"

namespace sonar {
namespace {

constexpr double none_db = -150;
/// How far beyond the range where the whole array's part leaves the sector the noise is followed, and where it begins to fade:
/// what groups hear in the outer beams would go on, and is not in the recording at 1.75 m, 3.7 times that range.
constexpr double margin = 3, fades_from = 2;

/// Of a part, blocks of samples of a beam are left out that are nowhere louder than this share of the channels' own noise (30),
/// over the number of parts.
constexpr double silent = 0.03;
constexpr std::size_t block_samples = 32;

constexpr int most_groups = 32;  // each has a table
// Of a table's complex values, 1 GiB, and of its sums: some 10 s.
constexpr double most_values = 1 << 27, most_steps = 1e9;

/// Mean over the beams of what they receive of the leak, re the sum of the channels' powers: where it is less, the beams point
/// at its nulls, and are not given the level of (31) nonetheless.
constexpr double faint = 1e-3;

/// Adding and subtracting it leaves a whole number.
constexpr float whole = 12582912;

bool has_noise(const SharedNoise& law) { return static_cast<double>(law.level_db) > none_db; }
int parts_of(const SharedNoise& law) { return law.channels / (law.group / 2) + 2; }

double focus_m(const SharedNoise& law, const PingSettings& settings) {
  return static_cast<double>(law.focus_rows) * settings.range_bin_m;
}

/// As far as the noise is followed: to `end_m`, over the last `fade_m` of which its power falls to nothing.
struct Reach {
  double end_m = 0, fade_m = 1;
  double share(double range_m) const { return std::clamp((end_m - range_m) / fade_m, 0.0, 1.0); }  // of its power
};
/// In a sector of beams of sines up to `widest`. Where the whole array's part never leaves it, the noise has no end.
Reach reach_of(const FrequencyMode& mode, const PingSettings& settings, double widest) {
  const SharedNoise& law = mode.receiver.shared_noise;
  const double sine = static_cast<double>(law.sine), outside = sine - widest;
  if (!has_noise(law)) return {};
  if (outside <= 0) return {.end_m = std::numeric_limits<double>::infinity()};
  const double leaves_m = (1 - sine * sine) * law.channels / 2 * device_wavelength_m(mode, settings) / (2 * sine) / outside;
  return {margin * leaves_m + std::max(0.0, -focus_m(law, settings)), (margin - fades_from) * leaves_m};
}

/// Complex [parts][beams]: sums over the channels of w_m (-1)^m e^{i 2 pi d / lambda}, d the delay of a channel at x against the
/// array's middle, from a point at a range and sine u. Parts: groups, which overlap by half and whose w^2 add to 1 in every
/// channel; last, all channels alike.
class FocusedArray {
 public:
  FocusedArray(const std::vector<double>& beam_sines, const SharedNoise& law)
      : u_(beam_sines.begin(), beam_sines.end()),
        channels_(law.channels),
        half_(law.group / 2),
        parts_(parts_of(law)),
        d_(1 / (2 * static_cast<double>(law.sine))) {
    re_.resize(static_cast<std::size_t>(parts_) * u_.size());
    im_.resize(re_.size());
  }
  int parts() const { return parts_; }
  void focus(double range_in_wavelengths) {
    std::fill(re_.begin(), re_.end(), 0.0f);
    std::fill(im_.begin(), im_.end(), 0.0f);
    const auto r = static_cast<float>(range_in_wavelengths);
    std::vector<float> cosine(u_.size()), sine(u_.size());
    for (int m = 0; m < channels_; ++m) {
      const auto x = static_cast<float>((m - 0.5 * (channels_ - 1)) * d_);
      for (std::size_t j = 0; j < u_.size(); ++j) {
        const float beyond = x * (x - 2 * r * u_[j]), delay = beyond / (std::sqrt(larger(r * r + beyond, 0)) + r);
        const float turns = delay - ((delay + whole) - whole);
        cosine[j] = sine_of_quarter(0.25f - std::fabs(turns));
        sine[j] = sine_of_half(turns);
      }
      const double sign = m % 2 == 0 ? 1 : -1, way = pi / 2 * (m % half_ + 0.5) / half_;
      add(m / half_, sign * std::cos(way), cosine, sine);
      add(m / half_ + 1, sign * std::sin(way), cosine, sine);
      add(parts_ - 1, sign, cosine, sine);
    }
  }
  std::complex<float> of(int part, std::size_t beam) const { return {re_[at(part) + beam], im_[at(part) + beam]}; }

 private:
  std::size_t at(int part) const { return static_cast<std::size_t>(part) * u_.size(); }
  void add(int part, double weight, const std::vector<float>& cosine, const std::vector<float>& sine) {
    const auto w = static_cast<float>(weight);
    float* __restrict re = re_.data() + at(part), * __restrict im = im_.data() + at(part);
    for (std::size_t j = 0; j < u_.size(); ++j) {
      re[j] += w * cosine[j];
      im[j] += w * sine[j];
    }
  }

  std::vector<float> u_, re_, im_;
  int channels_, half_, parts_;
  double d_;  // spacing of the channels, in wavelengths
};

}  // namespace

std::string why_impossible(const SharedNoise& law) {
  if (law.channels < 2 || law.channels % 2 != 0)
    return "channels must be even and at least 2, since neighbours have opposite signs, and are " + std::to_string(law.channels);
  const auto fits = [&](int group) {
    return group >= 2 && group % 2 == 0 && law.channels % (group / 2) == 0 && law.channels <= most_groups * group;
  };
  if (fits(law.group)) return {};
  int nearest = 2 * law.channels;
  for (int group = 2; group < 2 * law.channels; group += 2)
    if (fits(group) && std::abs(group - law.group) < std::abs(nearest - law.group)) nearest = group;
  return "group " + std::to_string(law.group) + " does not fit " + std::to_string(law.channels) +
         " channels: " + std::to_string(nearest) + " would do; it must be even, at least channels / " +
         std::to_string(most_groups) + ", and half of it must divide the channels";
}

std::string why_table_too_large(const FrequencyMode& mode, const PingSettings& settings, const Switches& switches) {
  const ReceiverModel& law = mode.receiver;
  const bool leaks = switches.leak && law.leak_is_shared;
  if (!switches.shared_noise || !(leaks || has_noise(law.shared_noise))) return {};
  const double widest = std::sin(std::min(static_cast<double>(mode.horizontal_aperture_rad) / 2, pi / 2));
  const double until_m = std::max(reach_of(mode, settings, widest).end_m, leaks ? Leak::reach_m(law) : 0);
  const double most = static_cast<double>(settings.range_bin_count) * settings.samples_per_row;
  const double samples = std::min(most, std::ceil(until_m / settings.range_bin_m * settings.samples_per_row) + 1);
  const double responses = samples * settings.beam_count;
  const double times =
      std::max(responses * parts_of(law.shared_noise) / most_values, responses * law.shared_noise.channels / most_steps);
  if (times <= 1) return {};
  return "the noise or leak that channels share would take about " + std::to_string(std::lround(std::ceil(times))) +
         " times the memory or time allowed: choose fewer rows, beams or channels, "
         "or in receiver.shared_noise a larger group or a sine outside the sector, or a leak that ends";
}

/// Eq. 47.
SharedNoiseTable::SharedNoiseTable(const PingPlan& plan) {
  const SharedNoise& law = plan.mode.receiver.shared_noise;
  const bool noise = has_noise(law);
  const Leak leak = plan.mode.receiver.leak_is_shared ? Leak(plan, plan.switches) : Leak();
  if (!plan.switches.shared_noise || !(noise || leak.is_audible())) return;
  const double wavelength_m = device_wavelength_m(plan.mode, plan.settings);
  const std::size_t beams = plan.beam_sine.size();
  double widest = 0;
  for (const double u : plan.beam_sine) widest = std::max(widest, std::abs(u));
  const Reach noise_reach = reach_of(plan.mode, plan.settings, widest);
  const auto range_m = [&](int n) { return (n + plan.sample_offset) * plan.sample_spacing_m; };
  const auto leak_samples = static_cast<int>(leak.rms_upa().size());
  while (samples_ < plan.samples && (range_m(samples_) < noise_reach.end_m || samples_ < leak_samples)) ++samples_;
  // A channel's own noise, by itself, is (30) at a beam's output.
  const double own_upa = plan.column_noise_upa * std::sqrt(plan.beam_weights.weight_energy / law.channels);
  const double level_upa = noise ? own_upa * amplitude_from_db(static_cast<double>(law.level_db)) : 0;
  const auto steady = static_cast<double>(law.steady);
  const double behind_m = focus_m(law, plan.settings);
  const double nearest_m = std::max(static_cast<double>(law.nearest_focus_m), plan.sample_spacing_m / 2);
  FocusedArray array(plan.beam_sine, law);
  parts_ = static_cast<std::size_t>(array.parts());
  beams_ = beams;
  const auto samples = static_cast<std::size_t>(samples_);
  response_.resize(2 * parts_ * beams * samples);
  const double least = faint * law.channels * static_cast<double>(beams);
  for (std::size_t n = 0; n < samples; ++n) {
    const double range = range_m(static_cast<int>(n)), r = std::max(range, plan.sample_spacing_m / 2);
    array.focus(std::max(range + behind_m, nearest_m) / wavelength_m);
    double power = 0;
    for (int part = 0; part < array.parts(); ++part)
      for (std::size_t j = 0; j < beams; ++j) {
        const std::complex<float> of_beam = array.of(part, j);
        float* to = response_.data() + 2 * (static_cast<std::size_t>(part) * beams + j) * samples + n;
        to[0] = of_beam.real();
        to[samples] = of_beam.imag();
        if (part + 1 == array.parts()) power += static_cast<double>(std::norm(of_beam));
      }
    const double upa = level_upa * std::sqrt(std::min(1.0, r / static_cast<double>(law.full_m)) * noise_reach.share(range));
    noise_upa_.push_back(static_cast<float>(upa * std::sqrt(1 - steady)));
    steady_upa_.push_back(static_cast<float>(upa * std::sqrt(steady)));
    // (31) at the beams' outputs, as a mean over them.
    const double per_channel = std::sqrt(plan.beam_weights.weight_energy * static_cast<double>(beams) / std::max(power, least));
    if (static_cast<int>(n) < leak_samples)
      leak_upa_.push_back(static_cast<float>(Leak::steady_part * static_cast<double>(leak.rms_upa()[n]) * per_channel));
  }
  leave_out(silent / array.parts() * own_upa * own_upa * law.channels);
}

void SharedNoiseTable::leave_out(double power) {
  const auto samples = static_cast<std::size_t>(samples_);
  blocks_ = (samples + block_samples - 1) / block_samples;
  for (std::size_t i = 0; i < parts_ * beams_ * blocks_; ++i) {
    const bool changes = i / (beams_ * blocks_) + 1 < parts_;
    const std::size_t from = i % blocks_ * block_samples, to = std::min(from + block_samples, samples);
    float *re = response_.data() + 2 * (i / blocks_ * samples), *im = re + samples;
    double most = 0;
    for (std::size_t n = from; n < to; ++n) {
      const float upa = changes ? noise_upa_[n] : steady_upa_[n] + (n < leak_upa_.size() ? leak_upa_[n] : 0);
      most = std::max(most, static_cast<double>(upa * upa * (re[n] * re[n] + im[n] * im[n])));
    }
    is_heard_.push_back(most > power ? 1 : 0);
    if (most > power) continue;
    std::fill(re + from, re + to, 0.0f);
    std::fill(im + from, im + to, 0.0f);
  }
}

double SharedNoiseTable::noise_power(std::size_t beam, std::size_t sample) const {
  if (sample >= noise_upa_.size()) return 0;
  double power = 0;
  for (std::size_t part = 0; part < parts_; ++part) {
    const float* r = response_.data() + 2 * (part * beams_ + beam) * noise_upa_.size() + sample;
    const float im = r[noise_upa_.size()], rms = part + 1 < parts_ ? noise_upa_[sample] : steady_upa_[sample];
    power += static_cast<double>(rms * rms * (r[0] * r[0] + im * im));
  }
  return power;
}

void SharedNoiseTable::draw(const PingNoise& key, bool noise, bool leak, bool expected_power, std::vector<float>& shared) const {
  const auto samples = static_cast<std::size_t>(samples_);
  shared.assign(2 * parts_ * samples, 0.0f);
  if (samples == 0) return;
  std::vector<float> draws(2 * samples);
  for (std::size_t part = 0; part + 1 < parts_ && noise; ++part) {
    float *re = shared.data() + 2 * part * samples, *im = re + samples;
    if (expected_power) {
      std::copy(noise_upa_.begin(), noise_upa_.end(), re);
      continue;
    }
    key.table->set(key.sonar, key.ping, static_cast<int>(first_shared_noise_column + part), 1, samples_, draws.data());
    for (std::size_t n = 0; n < samples; ++n) {
      re[n] = noise_upa_[n] * draws[2 * n];
      im[n] = noise_upa_[n] * draws[2 * n + 1];
    }
  }
  float* steady = shared.data() + 2 * (parts_ - 1) * samples;
  if (noise) std::copy(steady_upa_.begin(), steady_upa_.end(), steady);
  for (std::size_t n = 0; n < leak_upa_.size() && leak; ++n) steady[n] += leak_upa_[n];
}

void SharedNoiseTable::add(const std::vector<float>& shared, bool expected_power, BeamSignals& beams) const {
  const auto samples = static_cast<std::size_t>(samples_), first = static_cast<std::size_t>(beams.first_sample);
  const std::size_t last = std::min(first + static_cast<std::size_t>(beams.samples), samples);
  for (std::size_t j = 0; j < beams_ && first < last; ++j)
    for (std::size_t block = first / block_samples; block * block_samples < last; ++block) {
      const std::size_t from = std::max(first, block * block_samples), to = std::min(last, (block + 1) * block_samples);
      const auto count = static_cast<int>(to - from);
      float re[block_samples] = {}, im[block_samples] = {};
      for (std::size_t part = 0; part < parts_; ++part) {
        const std::size_t i = part * beams_ + j;
        if (is_heard_[i * blocks_ + block] == 0) continue;
        const float* __restrict r = response_.data() + 2 * i * samples + from, * __restrict r_im = r + samples;
        const float* __restrict c = shared.data() + 2 * part * samples + from, * __restrict c_im = c + samples;
        for (int n = 0; n < count && expected_power; ++n) re[n] += c[n] * c[n] * (r[n] * r[n] + r_im[n] * r_im[n]);
        for (int n = 0; n < count && !expected_power; ++n) {
          re[n] += c[n] * r[n] - c_im[n] * r_im[n];
          im[n] += c[n] * r_im[n] + c_im[n] * r[n];
        }
      }
      float* s = beams.beam(static_cast<int>(j)) + 2 * (from - first);
      for (int n = 0; n < count; ++n) {
        s[2 * n] += re[n];
        s[2 * n + 1] += im[n];
      }
    }
}

}  // namespace sonar
