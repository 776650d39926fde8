// Effects of a receiver's profile and focus on beams. Widths and noise are compared with closed forms and with sums over the
// array. If the parts are off or not given, they have no effect (docs/acoustics.md, sections 5 and 6).
#include "core/pipeline/plan_tables.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <memory>
#include <vector>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "tests/core/pipeline/kernel_sets.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test::beam_mix_test {
namespace {

double db(double power) { return 10 * std::log10(power); }

Sounding with(const std::function<void(ReceiverModel&)>& change, const SceneMaker& maker = {}, double range_m = 2, int rows = 700,
              int beam_count = 256) {
  FrequencyMode mode = oculus_high();
  change(mode.receiver);
  PingSettings settings = default_rows(range_m, rows);
  settings.beam_count = beam_count;
  return {maker.make(), mode, settings};
}

/// Returns the response of a beam at sine `beam` to a point at sine `u`: the sum over the aperture with a phase error of
/// edge_rad (2 x / L)^2.
double array_sum(const ReceivePattern& pattern, double u, double beam, double edge_rad) {
  constexpr int elements = 2000;
  std::complex<double> sum = 0;
  for (int i = 0; i < elements; ++i) {
    const double p = (i + 0.5) / elements - 0.5;
    double shading = 1;
    for (int m = 1; m < taper_terms; ++m) shading += 2 * pattern.series.c[m] * std::cos(2 * pi * m * p);
    sum += std::polar(shading / elements, edge_rad * 4 * p * p + 2 * pi * p * pattern.aperture_wavelengths * (u - beam));
  }
  return std::abs(sum);
}

TEST(Defocus, BlursAPointOffBroadsideAsTheArrayDoes) {
  const ReceivePattern pattern = receive_pattern(oculus_high().pattern);
  double worst = 0;
  for (const int beam_count : {256, 512})
    for (const double range_m : {0.3, 0.6, 1.5})
      for (const double azimuth_deg : {-25.0, 10.0, 20.0}) {
        const double azimuth = rad_from_deg(azimuth_deg), u = std::sin(azimuth);
        Sounding s = with([](ReceiverModel& law) { law.defocus = 1; },
                          SceneMaker().add_point({range_m * std::cos(azimuth), range_m * u, 0}, -40), 2, 700, beam_count);
        s.request.switches.defocus = false;
        s.ping();
        const int row = s.loudest_row(s.beam_at(azimuth));
        const double sharp = s.pressure(row, s.beam_at(azimuth)) / array_sum(pattern, u, s.beam_sine(s.beam_at(azimuth)), 0);
        s.request.switches.defocus = true;
        s.ping();
        const double aperture_m = pattern.aperture_wavelengths * 1500 / static_cast<double>(s.mode().centre_hz);
        const double edge_rad =
            pi * aperture_m * aperture_m * static_cast<double>(s.mode().centre_hz) / 1500 * u * u / (4 * range_m);
        double most = 0, off = 0;
        for (int j = 0; j < s.beams(); ++j) {
          const double expected = array_sum(pattern, u, s.beam_sine(j), edge_rad * std::pow(s.beam_sine(j) / u, 2));
          most = std::max(most, expected);
          off = std::max(off, std::abs(s.pressure(row, j) / sharp - expected));
        }
        worst = std::max(worst, off / most);
      }
  record_oracle(no_number, "focus for broadside: a point's beams against the sum over the array, re its loudest", 0, worst, 0.1,
                "");
}

TEST(Defocus, LeavesBroadsideAndFarEchoesAsTheyAre) {
  for (const Vec3d place : {Vec3d{0.4, 0, 0}, Vec3d{9, 0.4, 0}}) {
    Sounding s = with([](ReceiverModel& law) { law.defocus = 1; }, SceneMaker().add_point(place, -40), 10, 800);
    s.ping();
    const int beam = s.beam_at(std::atan2(place.y, place.x)), row = s.loudest_row(beam);
    const double on = s.pressure(row, beam);
    s.request.switches.defocus = false;
    s.ping();
    EXPECT_EQ(on, s.pressure(row, beam));
  }
}

// Compares vectors of samples that share their taps with the definition, one sample at a time (refocused).
TEST(Defocus, IsTheSumOverItsTapsInEveryInstructionSet) {
  Sounding s = with([](ReceiverModel& law) { law.defocus = 1; }, {}, 4, 300, 90);
  const PingPlan plan = make_plan(s.mode(), s.request.settings, s.request.switches);
  const BeamMixView v = plan.beam_mix.view();
  ASSERT_TRUE(plan.beam_mix.blurs());
  for (const simd::Kernels* kernels : kernel_sets())
    for (const int first : {0, 13, 64, 250}) {
      BeamSignals beams;
      beams.shape(90, first, 45);
      for (std::size_t i = 0; i < beams.data.size(); ++i)
        beams.data[i] = static_cast<float>(std::sin(static_cast<double>(i * i)));
      const std::vector<float> before = beams.data;
      std::vector<float> scratch;
      plan.beam_mix.blur(*kernels, beams, scratch);
      int blurred = 0;
      float off = 0;
      for (int j = 0; j < beams.beams; ++j)
        for (int n = 0; n < beams.samples; ++n) {
          const std::int32_t set = focus_set(v, j, first + n);
          const float *is = beams.beam(j) + 2 * n, *was = before.data() + j * beams.stride + 2 * n;
          blurred += set > 0;
          const MixedSample wanted = set > 0 ? refocused(v, before.data(), beams.stride, j, n, set) : MixedSample{was[0], was[1]};
          off = std::max({off, std::abs(is[0] - wanted.re), std::abs(is[1] - wanted.im)});
        }
      EXPECT_GT(blurred, 2000) << first;
      EXPECT_LT(off, 2e-6f) << kernels->name << " " << first;
    }
}

/// Returns the correlation of the complex noise of two beams, as a mean over all pairs with this distance.
double beam_correlation(const Sounding& s, int apart) {
  const auto& signal = s.last().beam_signal_upa;
  std::complex<double> product = 0;
  double power = 0;
  const auto beams = static_cast<std::size_t>(s.beams());
  for (std::size_t i = 0; i < signal.size(); ++i) {
    power += std::norm(std::complex<double>(signal[i]));
    if (i % beams + static_cast<std::size_t>(apart) < beams)
      product += std::complex<double>(signal[i]) * std::conj(std::complex<double>(signal[i + static_cast<std::size_t>(apart)]));
  }
  return product.real() / power * static_cast<double>(s.beams()) / (s.beams() - apart);
}

TEST(Blend, CorrelatesNeighboursAsItsShareSays) {
  const ReceivePattern pattern = receive_pattern(oculus_high().pattern);
  for (const float share : {-0.1f, 0.0f, 0.3f}) {
    Sounding s = with([&](ReceiverModel& law) { law.profile.blend = {share, share}; });
    s.request.switches.noise = s.request.switches.keep_beams = true;
    s.ping();
    const double spacing = s.beam_sine(0) - s.beam_sine(1);
    const auto plain = [&](int apart) {
      double product = 0, power = 0;
      for (double u = -0.5; u < 0.5; u += 1e-4) {
        product += pattern(u) * pattern(u + apart * spacing);
        power += pattern(u) * pattern(u);
      }
      return product / power;
    };
    const double b = static_cast<double>(share);
    const auto blended = [&](int n) {  // [b 1 b] applied twice
      return (1 + 2 * b * b) * plain(n) + 2 * b * (plain(n - 1) + plain(n + 1)) + b * b * (plain(n - 2) + plain(n + 2));
    };
    for (const int apart : {1, 2})
      record_oracle(no_number, "blended beams: correlation of noise", blended(apart) / blended(0), beam_correlation(s, apart),
                    0.03, "");
    double power = 0, before = 0;
    for (const auto& v : s.last().beam_signal_upa) power += std::norm(std::complex<double>(v));
    s.request.switches.uneven = false;
    s.ping();
    for (const auto& v : s.last().beam_signal_upa) before += std::norm(std::complex<double>(v));
    EXPECT_NEAR(db(power / before), 0, 0.1) << share;
  }
}

TEST(NoiseProfile, IsTheTablesByBeamNearAndFar) {
  for (const bool expected_power : {true, false}) {
    Sounding s = with([](ReceiverModel& law) {
      law.profile.noise_db = {-6, 2, -4};
      law.profile.near_noise_db = {8, -5, 4};
      law.profile.near_m = 0.2f;
    });
    s.request.switches.noise = true;
    s.request.switches.expected_power = expected_power;
    const auto power_of = [&](int row, int beam) {
      double sum = 0;
      int n = 0;
      for (int i = -20; i <= 20; ++i)
        for (int j = -4; j <= 4; ++j) sum += s.power(row + i, beam + j), ++n;
      return sum / n;
    };
    for (const int row : {30, 150, 650})
      for (const int beam : {30, 64, 128, 200}) {
        s.request.switches.uneven = true;
        s.ping();
        const double with_it = power_of(row, beam);
        s.request.switches.uneven = false;
        s.ping();
        const double u = s.beam_sine(beam), top = s.beam_sine(0), decay = std::exp(-s.range_of_row(row) / 0.2);
        const double far = u > 0 ? 2 - 8 * u / top : 2 + 6 * u / top, near = u > 0 ? -5 + 13 * u / top : -5 - 9 * u / top;
        const double expected = power_from_db(far) * (1 - decay) + power_from_db(near) * decay;
        EXPECT_NEAR(db(with_it / power_of(row, beam)), db(expected), 0.5) << row << " " << beam << " " << expected_power;
      }
  }
}

TEST(Bandwidth, TheNoiseHasItsOwnBandwidth) {
  Sounding s = with([](ReceiverModel& law) { law.noise_width = 0.7f; });
  s.request.switches.noise = s.request.switches.keep_beams = true;
  for (const bool on : {true, false}) {
    s.request.switches.bandwidth = on;
    s.ping();
    const auto& signal = s.last().beam_signal_upa;
    const auto beams = static_cast<std::size_t>(s.beams());
    double power = 0, product = 0;
    for (std::size_t i = 0; i + beams < signal.size(); ++i) {
      power += std::norm(std::complex<double>(signal[i]));
      product += (std::complex<double>(signal[i]) * std::conj(std::complex<double>(signal[i + beams]))).real();
    }
    const double width = static_cast<double>(s.request.settings.pulse_width_m) * (on ? static_cast<double>(0.7f) : 1.0);
    const double b = envelope_parameter_hz(1500, width);
    record_oracle(no_number, on ? "noise of its own bandwidth: rows apart 1" : "noise of the pulse's bandwidth: rows apart 1",
                  noise_correlation(b, 2 * s.request.settings.range_bin_m / 1500), product / power, 0.02, "");
    const double bandwidth_db = db(noise_bandwidth_hz(b)), level = db(power / static_cast<double>(signal.size() - beams));
    static double without_bandwidth = 0;
    if (on) without_bandwidth = level - bandwidth_db;
    EXPECT_NEAR(level - bandwidth_db, without_bandwidth, 0.15);
  }
}

TEST(BeamMix, ChangesNothingWhenOff) {
  const SceneMaker maker = SceneMaker().add_point({0.6, 0.3, 0}, -30);
  Sounding plain = with([](ReceiverModel&) {}, maker), given = with(
                                                           [](ReceiverModel&law) {
                                                             law.defocus = 1;
                                                             law.noise_width = 0.7f;
                                                             law.profile = {{-6, 2}, {8, 1}, 0.2f, {0.2f, 0.3f}};
                                                           },
                                                           maker);
  plain.request.switches.noise = given.request.switches.noise = true;
  EXPECT_NE(given.ping().pressure_upa, plain.ping().pressure_upa);
  given.request.switches.defocus = given.request.switches.uneven = given.request.switches.bandwidth = false;
  EXPECT_EQ(given.ping().pressure_upa, plain.ping().pressure_upa);
}

}  // namespace
}  // namespace sonar::test::beam_mix_test
