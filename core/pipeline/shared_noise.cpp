#include "core/pipeline/noise.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>

#include "core/pipeline/arithmetic/noise_place.hpp"
#include "core/pipeline/focused_array.hpp"
#include "core/pipeline/interference.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/plan_tables.hpp"

namespace sonar {
namespace {

constexpr double none_db = -150;
/// Limits of the range of shared noise, as multiples of the range at which the part of the whole array leaves the sector. The
/// noise fades from `fades_from` times this range on and ends at `margin` times. Without the fade, the noise of groups would
/// stay in the outer beams at all ranges. In the M1200d's high mode this range is 0.47 m (sine 0.5) and the fade ends at 1.41
/// m. The recording has no such noise at 1.75 m. Between 0.6 m and 1.75 m the recorded bed hides it.
constexpr double margin = 3, fades_from = 2;

/// A block of a part in a beam is omitted if its power is everywhere below this fraction, divided by the number of parts, of the
/// power of the channels' own noise (eq. 30).
constexpr double silent = 0.03;
constexpr std::size_t block_samples = SharedNoiseTable::block_samples;

constexpr int most_groups = 32;  // each group has a table
// Limits of the number of complex values of a table (1 GiB) and of the steps of its sums (about 10 s).
constexpr double most_values = 1 << 27, most_steps = 1e9;

/// Least mean power of the leak in the beams, re the sum of the channels' powers, at which the level of eq. 31 is applied. At
/// lower powers the beams point at nulls of the leak.
constexpr double faint = 1e-3;

bool has_noise(const SharedNoise& law) { return static_cast<double>(law.level_db) > none_db; }
int parts_of(const SharedNoise& law) { return law.channels / (law.group / 2) + 2; }

double focus_m(const SharedNoise& law, const PingSettings& settings) {
  return static_cast<double>(law.focus_rows) * settings.range_bin_m;
}

/// The range at which the shared noise ends is `end_m`. Over the last `fade_m` its power falls to 0.
struct Reach {
  double end_m = 0, fade_m = 1;
  double share(double range_m) const {
    return std::clamp((end_m - range_m) / fade_m, 0.0, 1.0);
  }  // fraction of the power that is left
};
/// The range limits in a sector of beams with sines up to `widest`. If the part of the whole array never leaves the sector, the
/// noise does not end.
Reach reach_of(const FrequencyMode& mode, const PingSettings& settings, double widest) {
  const SharedNoise& law = mode.receiver.shared_noise;
  const double sine = static_cast<double>(law.sine), outside = sine - widest;
  if (!has_noise(law)) return {};
  if (outside <= 0) return {.end_m = std::numeric_limits<double>::infinity()};
  const double leaves_m = (1 - sine * sine) * law.channels / 2 * device_wavelength_m(mode, settings) / (2 * sine) / outside;
  return {margin * leaves_m + std::max(0.0, -focus_m(law, settings)), (margin - fades_from) * leaves_m};
}

/// Responses of a block of samples. If interpolation is possible, they are computed at fewer focal ranges: Chebyshev points of
/// the inverse range, in which phases are nearly linear.
class Responses {
 public:
  /// `focal`: focal ranges of the samples, in wavelengths.
  void fill(FocusedArray& array, const std::vector<double>& focal) {
    beams_ = array.beams();
    samples_ = focal.size();
    std::vector<double> ranges = focal;
    weights_.clear();
    most_weight_ = 1;
    const int needed = chebyshev_count(pi * array.turns_between(focal.front(), focal.back()));
    if (static_cast<std::size_t>(needed) < samples_) choose(focal, needed, ranges);
    ranges_ = ranges.size();
    at_.clear();
    most_.assign(array.sums().size() / 2, 0.0f);
    for (const double range : ranges) {
      array.focus(range);
      at_.insert(at_.end(), array.sums().begin(), array.sums().end());
      for (std::size_t part = 0; part < static_cast<std::size_t>(array.parts()); ++part) {
        const float *re = array.sums().data() + 2 * part * beams_, *im = re + beams_;
        float* most = most_.data() + part * beams_;
        for (std::size_t j = 0; j < beams_; ++j) most[j] = larger(most[j], re[j] * re[j] + im[j] * im[j]);
      }
    }
  }
  /// Upper limit of the power in all samples.
  float most_power(std::size_t part, std::size_t beam) const { return most_[part * beams_ + beam] * most_weight_ * most_weight_; }
  void of(std::size_t part, std::size_t beam, float* re, float* im) const {
    for (std::size_t k = 0; k < ranges_; ++k) {
      const float* at = at_.data() + k * 2 * most_.size() + 2 * part * beams_ + beam;
      if (weights_.empty()) {
        re[k] = at[0], im[k] = at[beams_];
        continue;
      }
      const float* weight = weights_.data() + k * block_samples;
      const float a = at[0], b = at[beams_];
      for (std::size_t n = 0; n < block_samples; ++n) {
        re[n] = (k > 0 ? re[n] : 0) + weight[n] * a;
        im[n] = (k > 0 ? im[n] : 0) + weight[n] * b;
      }
    }
  }

 private:
  void choose(const std::vector<double>& focal, int count, std::vector<double>& ranges) {
    std::vector<double> places;
    for (const double r : focal) places.push_back(1 / r);
    const std::vector<double> points = chebyshev_points(places.back(), places.front(), count);
    const std::vector<double> weights = chebyshev_weights(points, places);
    ranges.clear();
    weights_.assign(points.size() * block_samples, 0.0f);
    for (std::size_t n = 0; n < samples_; ++n) {
      float sum = 0;
      for (std::size_t k = 0; k < points.size(); ++k) {
        weights_[k * block_samples + n] = static_cast<float>(weights[k * samples_ + n]);
        sum += std::fabs(weights_[k * block_samples + n]);
      }
      most_weight_ = std::max(most_weight_, sum);
    }
    for (const double point : points) ranges.push_back(1 / point);
  }

  std::size_t beams_ = 0, samples_ = 0, ranges_ = 0;
  std::vector<float> weights_;  // [ranges][block_samples]; empty: the ranges are those of the samples
  std::vector<float> at_;       // [ranges][parts][2][beams]
  std::vector<float> most_;     // [parts][beams]: power at the ranges
  float most_weight_ = 1;
};

}  // namespace

std::string why_impossible(const SharedNoise& law) {
  if (law.channels < 2 || law.channels % 2 != 0)
    return "channels must be even and at least 2 (neighbours have opposite signs), not " + std::to_string(law.channels);
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

/// The parts in a block of samples that are not omitted, in order.
struct SharedNoiseTable::Block {
  std::vector<std::size_t> at;  // part * beams + beam
  std::vector<float> stored;    // [at][2][block_samples]
};

/// Computes the table (eq. 47).
SharedNoiseTable::SharedNoiseTable(const PingPlan& plan, Parallel& pool) {
  const SharedNoise& law = plan.mode.receiver.shared_noise;
  const bool noise = has_noise(law);
  const Leak leak = plan.mode.receiver.leak_is_shared ? Leak(plan, plan.switches) : Leak();
  if (!plan.switches.shared_noise || !(noise || leak.is_audible())) return;
  const double wavelength_m = device_wavelength_m(plan.mode, plan.settings);
  beams_ = plan.beam_sine.size();
  double widest = 0;
  const std::vector<double> reported = make_beam_sines(plan.mode, plan.settings.beam_count);  // the sines that give the delays
  for (const double u : reported) widest = std::max(widest, std::abs(u));
  const Reach noise_reach = reach_of(plan.mode, plan.settings, widest);
  const auto range_m = [&](std::size_t n) { return (static_cast<double>(n) + plan.sample_offset) * plan.sample_spacing_m; };
  const std::size_t leak_samples = leak.rms_upa().size(), all = static_cast<std::size_t>(plan.samples);
  std::size_t samples = 0;
  while (samples < all && (range_m(samples) < noise_reach.end_m || samples < leak_samples)) ++samples;
  samples_ = static_cast<int>(samples);
  // Eq. 30 is the level of a channel's own noise at a beam's output.
  const double own_upa = plan.column_noise_upa * std::sqrt(plan.beam_weights.weight_energy / law.channels);
  const double level_upa = noise ? own_upa * amplitude_from_db(static_cast<double>(law.level_db)) : 0;
  const auto steady = static_cast<double>(law.steady);
  const double behind_m = focus_m(law, plan.settings);
  const double nearest_m = std::max(static_cast<double>(law.nearest_focus_m), plan.sample_spacing_m / 2);
  for (std::size_t n = 0; n < samples; ++n) {
    const double range = range_m(n), r = std::max(range, plan.sample_spacing_m / 2);
    const double upa = level_upa * std::sqrt(std::min(1.0, r / static_cast<double>(law.full_m)) * noise_reach.share(range));
    noise_upa_.push_back(static_cast<float>(upa * std::sqrt(1 - steady)));
    steady_upa_.push_back(static_cast<float>(upa * std::sqrt(steady)));
  }
  leak_upa_.assign(std::min(leak_samples, samples), 0.0f);
  struct Worker {
    FocusedArray array;
    Responses responses;
    std::vector<double> focal;
  };
  std::vector<Worker> workers(static_cast<std::size_t>(pool.threads()), Worker{{reported, law}, {}, {}});
  parts_ = static_cast<std::size_t>(workers[0].array.parts());
  const double least = faint * law.channels * static_cast<double>(beams_);
  const auto audible = static_cast<float>(silent / static_cast<double>(parts_) * own_upa * own_upa * law.channels);
  blocks_ = (samples + block_samples - 1) / block_samples;
  std::vector<Block> blocks(blocks_);
  pool.for_each(blocks_, [&](std::size_t block, int worker) {
    auto& [array, responses, focal] = workers[static_cast<std::size_t>(worker)];
    const std::size_t from = block * block_samples, to = std::min(from + block_samples, samples);
    focal.clear();
    for (std::size_t n = from; n < to; ++n) focal.push_back(std::max(range_m(n) + behind_m, nearest_m) / wavelength_m);
    responses.fill(array, focal);
    float re[block_samples] = {}, im[block_samples] = {};
    if (from < leak_samples) {
      double power[block_samples] = {};
      for (std::size_t j = 0; j < beams_; ++j) {
        responses.of(parts_ - 1, j, re, im);
        for (std::size_t n = 0; n < to - from; ++n) power[n] += static_cast<double>(re[n] * re[n] + im[n] * im[n]);
      }
      // Eq. 31 is the mean level at the outputs of beams.
      for (std::size_t n = from; n < std::min(to, leak_samples); ++n) {
        const double per_channel =
            std::sqrt(plan.beam_weights.weight_energy * static_cast<double>(beams_) / std::max(power[n - from], least));
        leak_upa_[n] = static_cast<float>(Leak::steady_part * static_cast<double>(leak.rms_upa()[n]) * per_channel);
      }
    }
    for (std::size_t part = 0; part < parts_; ++part) {
      float upa[block_samples], most_upa = 0;
      for (std::size_t n = from; n < to; ++n) {
        upa[n - from] = part + 1 < parts_ ? noise_upa_[n] : steady_upa_[n] + (n < leak_upa_.size() ? leak_upa_[n] : 0);
        most_upa = std::max(most_upa, upa[n - from]);
      }
      for (std::size_t j = 0; j < beams_; ++j) {
        if (most_upa * most_upa * responses.most_power(part, j) <= audible) continue;
        responses.of(part, j, re, im);
        float most = 0;
        for (std::size_t n = 0; n < to - from; ++n) most = std::max(most, upa[n] * upa[n] * (re[n] * re[n] + im[n] * im[n]));
        if (most <= audible) continue;
        blocks[block].at.push_back(part * beams_ + j);
        blocks[block].stored.insert(blocks[block].stored.end(), re, re + block_samples);
        blocks[block].stored.insert(blocks[block].stored.end(), im, im + block_samples);
      }
    }
  });
  gather(blocks);
}

/// Joins the blocks in order, so that the table does not depend on the number of threads.
void SharedNoiseTable::gather(std::vector<Block>& blocks) {
  std::size_t floats = 0;
  for (const Block& block : blocks) floats += block.stored.size();
  stored_.reserve(floats);
  at_.assign(parts_ * beams_ * blocks_, 0);
  for (std::size_t b = 0; b < blocks_; ++b) {
    auto count = static_cast<std::uint32_t>(stored_.size() / (2 * block_samples));
    for (const std::size_t at : blocks[b].at) at_[at * blocks_ + b] = ++count;
    stored_.insert(stored_.end(), blocks[b].stored.begin(), blocks[b].stored.end());
    blocks[b] = {};
  }
}

const float* SharedNoiseTable::stored(std::size_t part, std::size_t beam, std::size_t block) const {
  const std::size_t at = at_[(part * beams_ + beam) * blocks_ + block];
  return at == 0 ? nullptr : stored_.data() + 2 * block_samples * (at - 1);
}

std::vector<float> SharedNoiseTable::response() const {
  const auto samples = static_cast<std::size_t>(samples_);
  std::vector<float> dense(2 * parts_ * beams_ * samples, 0.0f);
  for (std::size_t i = 0; i < parts_ * beams_; ++i)
    for (std::size_t block = 0; block < blocks_; ++block) {
      const float* r = stored(i / beams_, i % beams_, block);
      if (r == nullptr) continue;
      const std::size_t from = block * block_samples, count = std::min(block_samples, samples - from);
      std::copy(r, r + count, dense.data() + 2 * i * samples + from);
      std::copy(r + block_samples, r + block_samples + count, dense.data() + (2 * i + 1) * samples + from);
    }
  return dense;
}

double SharedNoiseTable::noise_power(std::size_t beam, std::size_t sample) const {
  if (sample >= noise_upa_.size()) return 0;
  double power = 0;
  for (std::size_t part = 0; part < parts_; ++part) {
    const float* r = stored(part, beam, sample / block_samples);
    if (r == nullptr) continue;
    const float re = r[sample % block_samples], im = r[block_samples + sample % block_samples];
    const float rms = part + 1 < parts_ ? noise_upa_[sample] : steady_upa_[sample];
    power += static_cast<double>(rms * rms * (re * re + im * im));
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
        const float* __restrict r = stored(part, j, block);
        if (r == nullptr) continue;
        r += from - block * block_samples;
        const float* __restrict r_im = r + block_samples;
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
