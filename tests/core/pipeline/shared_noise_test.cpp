// Noise that all channels share: its power in every beam against the sum over the channels, its streaks, and nothing where it is
// off (docs/acoustics.md, section 5). Codes that are cut off, not rounded (section 7).
#include "core/pipeline/shared_noise.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "core/pipeline/arithmetic/receiver.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "tests/core/pipeline/kernel_sets.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

Sounding with(const std::function<void(ReceiverModel&)>& change, int threads = 2) {
  FrequencyMode mode = oculus_high();
  change(mode.receiver);
  PingSettings settings = default_rows(2, 700);
  settings.beam_count = 256;
  Sounding s(SceneMaker().make(), mode, settings, {.threads = threads, .engine = {}});
  s.request.switches.noise = true;
  return s;
}
const auto loud = [](ReceiverModel& law) { law.shared_noise.level_db = 60; };

// In power: the beam is focused at (r, u) by its delays, channel by channel, and hears signs in turns.
TEST(SharedNoise, IsTheFocusedArraysSumOverItsChannels) {
  Sounding s = with(loud);
  s.request.switches.expected_power = true;
  s.ping();
  const SharedNoise& law = s.mode().receiver.shared_noise;
  const double wavelength_m = 1500 / static_cast<double>(s.mode().centre_hz), sine = static_cast<double>(law.sine);
  const double own_upa = noise_rms_upa(s.mode(), noise_bandwidth_hz(s.envelope_hz()));
  double off = 0, most = 0, beside = 0;
  for (const int row : {60, 90, 130, 180, 220})
    for (int j = 0; j < s.beams(); ++j) {
      const double r = s.range_of_row(row), u = s.beam_sine(j);
      std::complex<double> sum = 0;
      for (int n = 0; n < law.channels; ++n) {
        const double x = (n - (law.channels - 1) / 2.0) * wavelength_m / (2 * sine);
        // To second order about the direction that the noise seems to come from.
        sum += std::polar(n % 2 == 0 ? 1.0 : -1.0, 2 * pi / wavelength_m * (x * x * (1 - sine * sine) / (2 * r) - x * u));
      }
      const double expected =
          power_from_db(60) * std::min(1.0, r / static_cast<double>(law.full_m)) * std::norm(sum) / law.channels;
      const double measured = s.power(row, j) / (own_upa * own_upa) - 1;
      most = std::max(most, expected);
      off = std::max(off, std::abs(measured - expected));
      // The shadow of the aperture: dark within the dome by rays.
      const double edge = sine - law.channels / 2.0 * wavelength_m / (2 * sine) * (1 - sine * sine) / r;
      if (std::abs(u) < edge - 0.06) beside = std::max(beside, measured / power_from_db(60));
    }
  record_oracle(no_number, "noise that channels share: beams against the sum over channels, re the loudest", 0, off / most, 1e-3,
                "");
  record_below(no_number, "noise that channels share: within the dome, re a channel's own", 0.5, beside, "");
}

// One draw a sample serves all beams: the ratio of two beams is that of their powers. The mean over draws is the power.
TEST(SharedNoise, IsOneDrawASampleNewInEveryPing) {
  Sounding s = with(loud);
  s.request.switches.expected_power = true;
  s.ping();
  const std::vector<float> mean = s.last().pressure_upa;
  s.request.switches.expected_power = false;
  double share = 0, together = 0, steady = 0;
  int n = 0, pairs = 0;
  std::map<int, double> before;  // by row
  for (std::uint32_t number = 1; number <= 40; ++number) {
    s.request.number = PingNumber{number};
    s.ping();
    for (const int row : {50, 70, 95}) {
      const auto at = [&](int beam) { return static_cast<std::size_t>(row * s.beams() + beam); };
      const auto draw = [&](int beam) {
        return std::pow(static_cast<double>(s.last().pressure_upa[at(beam)] / mean[at(beam)]), 2);
      };
      share += draw(3), ++n;
      together = std::max(together, std::abs(std::sqrt(draw(3) / draw(12)) - 1));
      if (const auto earlier = before.find(row); earlier != before.end()) {
        EXPECT_NE(draw(3), earlier->second) << "new in every ping";
        steady += draw(3) * earlier->second, ++pairs;
      }
      before[row] = draw(3);
    }
  }
  // Exponentially distributed: 120 draws have a mean of 1 within 0.09 (1 sigma); of products of two, within 0.2.
  EXPECT_NEAR(share / n, 1, 0.3);
  EXPECT_NEAR(steady / pairs, 1, 0.6);
  EXPECT_LT(together, 0.1) << "a channel's own noise is 60 dB lower";
}

TEST(SharedNoise, IsTheSameForAnyNumberOfThreadsAndNothingWhenOff) {
  Sounding one = with(loud, 1), three = with(loud, 3), none = with([](ReceiverModel&) {});
  EXPECT_EQ(one.ping().pressure_upa, three.ping().pressure_upa);
  EXPECT_NE(one.last().pressure_upa, none.ping().pressure_upa);
  one.request.switches.shared_noise = false;
  EXPECT_EQ(one.ping().pressure_upa, none.last().pressure_upa);
  one.request.switches.shared_noise = true;
  one.request.switches.noise = none.request.switches.noise = false;
  EXPECT_EQ(one.ping().pressure_upa, none.ping().pressure_upa);
}

TEST(Truncation, CutsCodesOffInEveryInstructionSet) {
  std::vector<float> power;
  for (int i = 0; i < 4096; ++i) power.push_back(std::exp2(-24.0f + static_cast<float>(i) * 0.006f));
  const int n = static_cast<int>(power.size());
  for (const SampleFormat& format : {SampleFormat{8, 254, 0.5f, false}, SampleFormat{8, 254, 1, false}})
    for (const bool truncates : {false, true})
      for (const simd::Kernels* kernels : kernel_sets()) {
        const float top = static_cast<float>(format.max_code);
        const simd::CodeScale scale{format.gamma / 2, truncates ? top + 1 : top, truncates ? 0.0f : 0.5f, top};
        std::vector<std::uint8_t> bytes(power.size());
        std::vector<float> codes(power.size());
        kernels->quantise_bytes(power.data(), 1, scale, bytes.data(), n);
        kernels->quantise(power.data(), 1, scale, codes.data(), n);
        int other = 0;
        for (std::size_t i = 0; i < power.size(); ++i) {
          const std::uint32_t wanted = quantise(std::sqrt(static_cast<double>(power[i])), format, truncates);
          EXPECT_NEAR(bytes[i], static_cast<double>(wanted), 1);
          other += bytes[i] != wanted;
          EXPECT_EQ(static_cast<float>(bytes[i]), codes[i]);
        }
        EXPECT_LT(other, 8) << kernels->name << ": at the very edge of a code";
      }
}

TEST(Truncation, IsOfAReceiverThatTruncates) {
  Sounding s = with([](ReceiverModel&law) { law.truncates = true; }), rounded = with([](ReceiverModel&) {});
  for (Sounding* one : {&s, &rounded}) {
    auto model = std::make_shared<SonarModel>(*one->request.model);
    model->modes[0].receiver.full_scale_upa = 1e5f;
    one->request.model = model;
    one->request.settings.format = {8, 254, 0.5f, false};
  }
  const Ping cut = s.ping(), round = rounded.ping();
  ASSERT_EQ(cut.pressure_upa, round.pressure_upa);
  int other = 0;
  for (int row = 0; row < s.rows(); ++row) {
    const ReceiverModel& law = s.mode().receiver;
    const double factor = full_scale_factor(law, tvg_db(law, s.range_of_row(row), 0));
    for (int j = 0; j < s.beams(); ++j) {
      const auto code = static_cast<std::uint32_t>(cut.samples[static_cast<std::size_t>(row * s.beams() + j)]);
      const std::uint32_t wanted = quantise(s.pressure(row, j) * factor, s.request.settings.format, true);
      EXPECT_NEAR(code, static_cast<double>(wanted), 1);
      other += code != wanted;
    }
  }
  EXPECT_LT(other, 200) << "of 179,200: at the very edge of a code";
  EXPECT_NE(cut.samples, round.samples);
  s.request.switches.truncation = false;
  EXPECT_EQ(s.ping().samples, round.samples);
}

}  // namespace
}  // namespace sonar::test
