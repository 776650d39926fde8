// Class BeamMix (core/pipeline/plan_tables.hpp), which mixes neighbouring beams.
#include <algorithm>
#include <cmath>
#include <complex>

#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/plan_tables.hpp"

namespace sonar {
namespace {

constexpr double set_rad = 0.5;  // phase step at the aperture's ends between sets of taps; the error is at most half of this
constexpr double most_rad = 16;  // largest phase error; at shorter ranges it stays at this value
constexpr int aperture_points = 512;
constexpr double neighbour_in_beams = 0.56;  // distance of a neighbour in -3 dB widths: the spacing of 256 beams of the M1200d

/// The first sample after `n` whose set of taps differs from that of `n`. Sets change with 1 / range.
int end_of_set(const BeamMixView& v, int j, int first_sample, int n, std::int32_t set, int samples) {
  const float until_m = v.turn_m[j] * v.sets_per_rad / (static_cast<float>(set) - 0.5f);
  const float guess = std::clamp((until_m - v.first_range_m) / v.sample_m - static_cast<float>(first_sample),
                                 static_cast<float>(n + 1), static_cast<float>(samples));
  int end = static_cast<int>(guess);
  while (end > n + 1 && focus_set(v, j, first_sample + end - 1) != set) --end;
  while (end < samples && focus_set(v, j, first_sample + end) == set) ++end;
  return end;
}

/// Applies blended() to all beams in place. The ring `before` stores the old values of a beam for the beam `step` after it.
void blend_in_place(const BeamMixView& v, BeamSignals& beams, std::vector<float>& before) {
  const int floats = 2 * beams.samples;
  before.assign(static_cast<std::size_t>(v.step + 1) * static_cast<std::size_t>(floats), 0.0f);
  const float* nothing = before.data() + static_cast<std::ptrdiff_t>(v.step) * floats;  // stands for beams beyond the last one
  for (int j = 0; j < beams.beams; ++j) {
    const float own = v.own[j], share = v.share[j];
    float* __restrict to = beams.beam(j);
    float* __restrict port = before.data() + static_cast<std::ptrdiff_t>(j % v.step) * floats;
    const float* starboard = j + v.step < beams.beams ? beams.beam(j + v.step) : nothing;
    for (int i = 0; i < floats; ++i) {
      const float here = to[i];
      to[i] = own * here + share * port[i] + share * starboard[i];
      port[i] = here;
    }
  }
}

}  // namespace

double at_sine(const std::vector<float>& table, double sine, double top) {
  if (table.size() < 2) return table.empty() ? 0 : static_cast<double>(table.front());
  const double at = std::clamp(0.5 * (1 - sine / top), 0.0, 1.0) * static_cast<double>(table.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), table.size() - 2);
  const double t = at - static_cast<double>(i);
  return (1 - t) * static_cast<double>(table[i]) + t * static_cast<double>(table[i + 1]);
}

BeamMix::BeamMix(const PingPlan& plan) {
  const FrequencyMode& mode = plan.mode;
  const std::size_t beams = plan.beam_sine.size();
  if (mode.beam_spacing != BeamSpacing::uniform_in_sine || beams < 3 || mode.pattern.azimuth_taper == Taper::unit) return;
  const double spacing = plan.beam_sine[0] - plan.beam_sine[1];
  if (plan.switches.defocus && mode.receiver.defocus > 0) lay_out_focus(plan, spacing);
  if (plan.switches.uneven && !mode.receiver.profile.blend.empty()) lay_out_blend(plan, spacing);
}

/// With the delays of broadside, the phase pi x^2 sin^2(theta) / (lambda r) remains at position x of the aperture L (eq. 44).
/// Beams that are uniform in the sine are samples of the aperture's transform. Therefore a factor on the aperture is a
/// convolution across the beams.
void BeamMix::lay_out_focus(const PingPlan& plan, double spacing) {
  const double wavelengths = plan.beam_pattern[0].aperture_wavelengths;
  const double wavelength_m = device_wavelength_m(plan.mode, plan.settings);
  const double edge_rad_m = static_cast<double>(plan.mode.receiver.defocus) * pi * wavelengths * wavelengths * wavelength_m / 4;
  for (const double u : plan.beam_sine) turn_m_.push_back(static_cast<float>(edge_rad_m * u * u));
  largest_turn_m_ = *std::max_element(turn_m_.begin(), turn_m_.end());
  first_range_m_ = static_cast<float>(plan.sample_offset * plan.sample_spacing_m);
  sample_m_ = static_cast<float>(plan.sample_spacing_m);
  const int sets = static_cast<int>(most_rad / set_rad) + 1;
  // The largest slope of the phase, 4 edge / L, shifts the echo by 2 edge / (pi L) in the sine.
  const auto reach_of = [&](int set) {
    return set == 0 ? 0 : static_cast<int>(std::ceil(2 * set_rad * set / (pi * wavelengths * spacing))) + 2;
  };
  widest_ = reach_of(sets - 1);
  taps_.assign(2 * static_cast<std::size_t>(sets * (2 * widest_ + 1)), 0.0f);
  // The taps are sums over one period of the positions that beams of this spacing can distinguish. Beyond the aperture, where
  // there is no signal, the phase is constant. The points lie on both sides of the middle, at odd multiples of 1 / circle.
  constexpr int half = aperture_points / 2, circle = 2 * aperture_points;
  std::vector<double> cosine, place2;
  for (int i = 0; i < circle; ++i) cosine.push_back(std::cos(2 * pi * i / circle));
  for (int i = 0; i < half; ++i)
    place2.push_back(std::pow(std::min(2 * (i + 0.5) / aperture_points / (wavelengths * spacing), 1.0), 2));
  std::vector<std::complex<double>> phase(half), taps;
  for (int set = 0; set < sets; ++set) {
    reach_.push_back(reach_of(set));
    taps.assign(static_cast<std::size_t>(reach_.back() + 1), 0);
    for (std::size_t i = 0; i < half; ++i) phase[i] = std::polar(2.0 / aperture_points, set_rad * set * place2[i]);
    double energy = 0;
    for (std::size_t d = 0; d < taps.size(); ++d) {
      for (std::size_t i = 0; i < half; ++i) taps[d] += phase[i] * cosine[d * (2 * i + 1) % circle];
      energy += std::norm(taps[d]) * (d == 0 ? 1 : 2);
    }
    float* to = taps_.data() + 2 * (set * (2 * widest_ + 1) + widest_ - reach_.back());
    for (int d = -reach_.back(); d <= reach_.back(); ++d) {
      const std::complex<double> tap = taps[static_cast<std::size_t>(std::abs(d))];
      // The power of a diffuse field must not change.
      const std::complex<double> t = plan.expected_power ? std::norm(tap) / energy : tap / std::sqrt(energy);
      *to++ = static_cast<float>(t.real());
      *to++ = static_cast<float>(t.imag());
    }
  }
}

void BeamMix::lay_out_blend(const PingPlan& plan, double spacing) {
  const ReceivePattern& pattern = plan.beam_pattern[0];
  const double width = 2 * std::sin(static_cast<double>(plan.mode.pattern.azimuth_width_rad) / 2);
  step_ = std::max(1, static_cast<std::int32_t>(std::lround(neighbour_in_beams * width / spacing)));
  // Gamma of eq. 45: correlation of a diffuse field between two beams that are this far apart.
  const auto common = [&](int apart) {
    double product = 0, power = 0;
    for (int k = -plan.columns.count; k <= plan.columns.count; ++k) {
      const double u = k * plan.columns.spacing;
      product += pattern(u) * pattern(u + apart * spacing);
      power += pattern(u) * pattern(u);
    }
    return product / power;
  };
  const double one = common(step_), two = common(2 * step_), top = plan.beam_sine.front();
  for (const double u : plan.beam_sine) {
    // Eq. 45: the power of a diffuse field does not change.
    const double b = at_sine(plan.mode.receiver.profile.blend, u, top);
    const double own = plan.expected_power ? 1 / (1 + 2 * b * b) : 1 / std::sqrt(1 + 2 * b * b * (1 + two) + 4 * b * one);
    own_.push_back(static_cast<float>(own));
    share_.push_back(static_cast<float>(own * (plan.expected_power ? b * b : b)));
  }
}

BeamMixView BeamMix::view() const {
  BeamMixView v{};
  v.turn_m = blurs() ? turn_m_.data() : nullptr;
  v.taps = taps_.data();
  v.reach = reach_.data();
  v.own = blends() ? own_.data() : nullptr;
  v.share = share_.data();
  v.beams = static_cast<std::int32_t>(std::max(turn_m_.size(), own_.size()));
  v.sets = static_cast<std::int32_t>(reach_.size());
  v.widest = widest_;
  v.step = step_;
  v.sets_per_rad = static_cast<float>(1 / set_rad);
  v.first_range_m = first_range_m_;
  v.sample_m = sample_m_;
  return v;
}

std::size_t BeamMix::bytes() const {
  return sizeof(float) * (turn_m_.capacity() + taps_.capacity() + own_.capacity() + share_.capacity()) +
         sizeof(std::int32_t) * reach_.capacity();
}

void BeamMix::blur(const simd::Kernels& kernels, BeamSignals& beams, std::vector<float>& scratch) const {
  const BeamMixView v = view();
  const float nearest_m = std::max(v.first_range_m + v.sample_m * static_cast<float>(beams.first_sample), v.sample_m);
  if (!blurs() || largest_turn_m_ * v.sets_per_rad < 0.5f * nearest_m) return;
  constexpr std::size_t vector = 16;  // kernels read whole vectors
  scratch.resize(beams.data.size() + vector);
  std::copy(beams.data.begin(), beams.data.end(), scratch.begin());
  for (int j = 0; j < beams.beams; ++j)
    // Processes neighbouring samples with the same taps together. The number of the set falls with the range to 0 and then
    // stays 0.
    for (int n = 0; n < beams.samples;) {
      const std::int32_t set = focus_set(v, j, beams.first_sample + n);
      if (set == 0) break;
      const int end = end_of_set(v, j, beams.first_sample, n, set, beams.samples);
      const float* taps = v.taps + 2 * (static_cast<std::ptrdiff_t>(set) * (2 * v.widest + 1) + v.widest);
      const simd::FocusTaps both{taps, std::min(v.reach[set], j), std::min(v.reach[set], v.beams - 1 - j)};
      kernels.refocus(scratch.data() + j * beams.stride + 2 * n, beams.stride, both, 2 * (end - n), beams.beam(j) + 2 * n);
      n = end;
    }
}

void BeamMix::blend(BeamSignals& beams, std::vector<float>& scratch) const {
  if (blends()) blend_in_place(view(), beams, scratch);
}

}  // namespace sonar
