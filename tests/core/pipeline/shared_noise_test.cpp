// Noise and leak that channels share: power in every beam compared with the sum over the channels, correlation of beams, the
// range at which the noise ends, and no effect if it is off (docs/acoustics.md, section 5). Also codes that are truncated
// instead of rounded (section 7).
#include "core/pipeline/noise.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/pipeline/arithmetic/receiver.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "core/pipeline/focused_array.hpp"
#include "core/pipeline/ping_engine.hpp"
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

constexpr int all = -1;

/// Returns the sum over channels with alternating signs, whose delays focus at `r` and sine `u`: over all channels, or over
/// group `g`. The weights of a group are half a period of a sine. The next group begins half a group later.
std::complex<double> focused(const FrequencyMode& mode, double r, double u, int g) {
  const SharedNoise& law = mode.receiver.shared_noise;
  const double wavelength_m = 1500 / static_cast<double>(mode.centre_hz),
               spacing_m = wavelength_m / (2 * static_cast<double>(law.sine));
  std::complex<double> sum = 0;
  for (int n = 0; n < law.channels; ++n) {
    const double x = (n - (law.channels - 1) / 2.0) * spacing_m, half = law.group / 2.0, place = (n + 0.5 - half * g) / half;
    if (g != all && std::abs(place) > 1) continue;
    const double weight = (n % 2 == 0 ? 1.0 : -1.0) * (g == all ? 1.0 : std::cos(pi / 2 * place));
    sum += std::polar(weight, 2 * pi / wavelength_m * (std::sqrt(r * r - 2 * r * x * u + x * x) - r));
  }
  return sum;
}
int groups(const FrequencyMode& mode) {
  const SharedNoise& law = mode.receiver.shared_noise;
  return 2 * law.channels / law.group + 1;
}
double focused_power(const FrequencyMode& mode, double r, double u) { return std::norm(focused(mode, r, u, all)); }
/// Returns E[a b*] of two beams, divided by a channel's power.
std::complex<double> in_common(const FrequencyMode& mode, double r, double u, double v) {
  std::complex<double> sum = 0;
  for (int g = 0; g < groups(mode); ++g) sum += focused(mode, r, u, g) * std::conj(focused(mode, r, v, g));
  return sum;
}

/// Returns the fraction of the power that is left at range `r`. It fades from 2 to 3 times the range at which the whole
/// array's part leaves the sector.
double fade(const FrequencyMode& mode, double r) {
  const SharedNoise& law = mode.receiver.shared_noise;
  const double sine = static_cast<double>(law.sine), widest = std::sin(static_cast<double>(mode.horizontal_aperture_rad) / 2),
               wavelength_m = 1500 / static_cast<double>(mode.centre_hz);
  const double leaves_m = law.channels * wavelength_m / (4 * sine) * (1 - sine * sine) / (sine - widest);
  return std::clamp(3 - r / leaves_m, 0.0, 1.0);
}

class ChannelsShare : public ::testing::TestWithParam<float> {};

TEST_P(ChannelsShare, IsTheFocusedArraysSumOverItsChannels) {
  const auto level_db = static_cast<double>(GetParam());
  for (const float share : {0.0f, 1.0f}) {
    Sounding s = with([=](ReceiverModel& law) {
      law.shared_noise.level_db = GetParam();
      law.shared_noise.steady = share;
    });
    s.request.switches.expected_power = true;
    s.ping();
    const SharedNoise& law = s.mode().receiver.shared_noise;
    const double wavelength_m = 1500 / static_cast<double>(s.mode().centre_hz), sine = static_cast<double>(law.sine);
    const double own_upa = noise_rms_upa(s.mode(), noise_bandwidth_hz(s.envelope_hz()));
    double off = 0, most = 0, beside = 0;
    for (const int row : {60, 90, 130, 180, 220, 330, 400, 470, 520})
      for (int j = 0; j < s.beams(); ++j) {
        const double r = s.range_of_row(row), u = s.beam_sine(j);
        const double power = share > 0 ? focused_power(s.mode(), r, u) : in_common(s.mode(), r, u, u).real();
        const double expected = power_from_db(level_db) * fade(s.mode(), r) * std::min(1.0, r / static_cast<double>(law.full_m)) *
                                power / law.channels;
        const double measured = s.power(row, j) / (own_upa * own_upa) - 1;
        most = std::max(most, expected);
        off = std::max(off, std::abs(measured - expected));
        // Within the dome is the aperture's shadow, which is dark by ray geometry.
        const double edge = sine - law.channels / 2.0 * wavelength_m / (2 * sine) * (1 - sine * sine) / r;
        if (std::abs(u) < edge - 0.06) beside = std::max(beside, measured / power_from_db(level_db));
      }
    if (level_db < 20) {
      EXPECT_LT(off, 0.03) << "omitted power, relative to the channels' own noise";
      continue;
    }
    const std::string part = share > 0 ? "steady" : "changing";
    record_oracle(no_number, part + " noise that channels share: beams against the sum over channels, re the loudest", 0,
                  off / most, 1e-3, "");
    record_below(no_number, part + " noise that channels share: within the dome, re a channel's own", 0.5, beside, "");
  }
}
INSTANTIATE_TEST_SUITE_P(OfALevel, ChannelsShare, ::testing::Values(60.0f, 3.4f));

// Compares each part of each beam with the sum over its channels in double precision, from inside the array to far away.
// Sectors have one beam, or extend to the array's own line, where the phases are most difficult.
TEST(FocusedArray, IsTheSumOverItsChannels) {
  struct Case {
    int beams;
    double widest;
    SharedNoise law;
  };
  const SharedNoise usual, small{.channels = 40, .group = 8, .sine = 0.3f}, single{.channels = 6, .group = 2};
  for (const Case& c : {Case{512, 0.5, usual}, Case{256, 0.5, usual}, Case{1, 0, usual}, Case{300, 0.95, usual},
                        Case{90, 0.7, small}, Case{17, 1, single}}) {
    std::vector<double> sines;
    for (int j = 0; j < c.beams; ++j) sines.push_back(c.beams > 1 ? c.widest * (1 - 2.0 * j / (c.beams - 1)) : 0.0);
    FocusedArray array(sines, c.law);
    const int half = c.law.group / 2;
    double off = 0, loudest = 0;
    for (const double r : {0.7, 3.0, 7.0, 20.0, 57.0, 130.0, 700.0, 2000.0}) {
      array.focus(r);
      for (std::size_t j = 0; j < sines.size(); ++j) {
        std::vector<std::complex<double>> sums(static_cast<std::size_t>(array.parts()));
        for (int m = 0; m < c.law.channels; ++m) {
          const double x = (m - 0.5 * (c.law.channels - 1)) / (2 * static_cast<double>(c.law.sine));
          const double delay = std::sqrt(std::max(r * r - 2 * r * x * sines[j] + x * x, 0.0)) - r;
          const std::complex<double> e = std::polar(m % 2 == 0 ? 1.0 : -1.0, 2 * pi * delay);
          const double way = pi / 2 * (m % half + 0.5) / half;
          sums[static_cast<std::size_t>(m / half)] += std::cos(way) * e;
          sums[static_cast<std::size_t>(m / half + 1)] += std::sin(way) * e;
          sums.back() += e;
        }
        for (std::size_t part = 0; part < sums.size(); ++part) {
          const float* of = array.sums().data() + 2 * part * sines.size() + j;
          off = std::max(off, std::abs(sums[part] - std::complex<double>(of[0], of[sines.size()])));
          loudest = std::max(loudest, std::abs(sums[part]));
        }
      }
    }
    record_oracle(no_number,
                  "focused array, " + std::to_string(c.beams) + " beams: against the sum over channels, re the loudest", 0,
                  off / loudest, 5e-5, "");
  }
}

TEST(SharedNoise, KeepsOnlyAudibleParts) {
  Sounding s = with([](ReceiverModel& law) { law.shared_noise.level_db = 3.4f; });
  const SharedNoiseTable table = make_plan(s.mode(), s.request.settings, {}).shared_noise;
  ASSERT_TRUE(table.is_audible());
  EXPECT_LT(table.bytes(), table.response().size() * sizeof(float) * 7 / 10);
}

// The noise ends without a step in all beams.
TEST(SharedNoise, FadesOutBeyondTheSector) {
  Sounding s = with([](ReceiverModel& law) { law.shared_noise.level_db = 10; });
  s.request.switches.expected_power = true;
  s.ping();
  const double own_upa = noise_rms_upa(s.mode(), noise_bandwidth_hz(s.envelope_hz()));
  double loudest = 0;
  for (int row = 300; row + 1 < s.rows(); ++row)
    for (int j = 0; j < s.beams(); ++j) {
      loudest = std::max(loudest, s.power(row, j) / (own_upa * own_upa));
      EXPECT_NEAR(s.power(row, j) / s.power(row + 1, j), 1, 0.1) << "row " << row << ", beam " << j;
    }
  EXPECT_GT(loudest, 3);
  EXPECT_NEAR(s.power(s.rows() - 1, 0) / (own_upa * own_upa), 1, 0.01);
}

// Correlation of two beams, over 30 pings and 50 rows, compared with the sum over groups. Two pings are not correlated.
TEST(SharedNoise, IsOneDrawPerGroupNewInEveryPing) {
  Sounding s = with(loud);
  s.request.switches.keep_beams = true;
  std::vector<std::complex<float>> before;
  double expected_power = 0, alike = 0, earlier = 0;
  for (std::uint32_t number = 1; number <= 30; ++number) {
    s.request.number = PingNumber{number};
    s.ping();
    const std::vector<std::complex<float>>& beams = s.last().beam_signal_upa;
    for (int row = 40; row < 140; row += 2)
      for (const int beam : {3, 8, 200}) {
        const double r = s.range_of_row(row), u = s.beam_sine(beam), v = s.beam_sine(beam + 3);
        const std::complex<double> scale =
            std::conj(in_common(s.mode(), r, u, v)) / (in_common(s.mode(), r, u, u).real() * in_common(s.mode(), r, v, v).real());
        const auto at = static_cast<std::size_t>(row * s.beams() + beam);
        const double own_upa = noise_rms_upa(s.mode(), noise_bandwidth_hz(s.envelope_hz())),
                     c = own_upa * own_upa * power_from_db(60) / 128 *
                         std::min(1.0, r / static_cast<double>(s.mode().receiver.shared_noise.full_m));
        const auto of = [&](const std::vector<std::complex<float>>& from) {
          return (std::complex<double>(beams[at]) * std::conj(std::complex<double>(from[at + 3])) * scale).real() / c;
        };
        expected_power += (in_common(s.mode(), r, u, v) * scale).real();
        alike += of(beams);
        if (!before.empty()) earlier += of(before);
      }
    before = beams;
  }
  EXPECT_GT(expected_power, 0.3 * 30 * 50 * 3) << "neighbours have much in common";
  EXPECT_NEAR(alike / expected_power, 1, 0.1);
  EXPECT_NEAR(earlier / expected_power, 0, 0.1);
}

// With 90 % steady noise, two pings differ by a tenth of the power each, and the mean power is unchanged.
TEST(SharedNoise, HasASteadyPart) {
  Sounding s = with([](ReceiverModel& law) {
    loud(law);
    law.shared_noise.steady = 0.9f;
  });
  s.request.switches.expected_power = true;
  s.ping();
  const std::vector<float> mean = s.last().pressure_upa;
  s.request.switches.expected_power = false;
  s.request.switches.keep_beams = true;
  std::vector<std::complex<float>> before;
  double power = 0, difference = 0;
  for (std::uint32_t number = 1; number <= 20; ++number) {
    s.request.number = PingNumber{number};
    s.ping();
    const std::vector<std::complex<float>>& beams = s.last().beam_signal_upa;
    ASSERT_EQ(beams.size(), mean.size()) << "one sample per row";
    for (int row = 40; row < 110; ++row) {
      const auto at = static_cast<std::size_t>(row * s.beams() + 4);
      const double of_mean = std::pow(static_cast<double>(mean[at]), 2);
      power += static_cast<double>(std::norm(beams[at])) / of_mean / (20 * 70);
      if (!before.empty()) difference += static_cast<double>(std::norm(beams[at] - before[at])) / of_mean / (19 * 70);
    }
    before = beams;
  }
  EXPECT_NEAR(power, 1, 0.05);
  EXPECT_NEAR(difference, 0.2, 0.02);
}

// The leak through the same channels: fringes of the focused array. Their mean over the beams equals the leak without sharing.
// Only the changing part differs from ping to ping.
TEST(SharedLeak, IsTheSumOfTheFocusedArray) {
  const auto leaking = [](ReceiverModel& law) {
    law.leak_upa = 1e8f;
    law.leak_decay_db_per_m = 200;
    law.leak_is_shared = true;
    law.shared_noise.focus_rows = 0.5f;
    law.shared_noise.nearest_focus_m = 0.0085f;
  };
  Sounding s = with(leaking);
  s.request.switches.noise = false;
  s.request.switches.expected_power = true;
  s.ping();
  const double row_m = s.range_of_row(1) - s.range_of_row(0);
  double worst = 0;
  for (const int row : {0, 1, 5, 12, 30}) {
    const double focus_m = std::max(s.range_of_row(row) + row_m / 2, 0.0085);
    std::vector<double> expected;
    double mean = 0;
    for (int j = 0; j < s.beams(); ++j) {
      expected.push_back(focused_power(s.mode(), focus_m, s.beam_sine(j)));
      mean += expected.back() / s.beams();
    }
    for (int j = 0; j < s.beams(); ++j) {
      const double level = 1e16 * power_from_db(-200 * s.range_of_row(row));
      const double share = 0.98 * expected[static_cast<std::size_t>(j)] / mean + 0.02;
      worst = std::max(worst, std::abs(s.power(row, j) / level - share));
    }
  }
  EXPECT_LT(worst, 0.01);

  s.request.switches.expected_power = false;
  s.request.switches.keep_beams = true;
  s.ping();
  const std::vector<std::complex<float>> before = s.last().beam_signal_upa;
  s.request.number = PingNumber{7};
  s.ping();
  double power = 0, difference = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(10 * s.beams()); ++i) {
    power += static_cast<double>(std::norm(before[i])) / 2 + static_cast<double>(std::norm(s.last().beam_signal_upa[i])) / 2;
    difference += static_cast<double>(std::norm(before[i] - s.last().beam_signal_upa[i]));
  }
  EXPECT_NEAR(difference / power, 2 * 0.02, 0.01) << "steady except for 2 % of the power";
  s.request.switches.leak = false;
  s.ping();
  EXPECT_EQ(s.pressure(3, 40), 0);
}

// One beam straight ahead, where the signs cancel. It must not get the level of the mean.
TEST(SharedLeak, IsNotRaisedInNulls) {
  Sounding s = with([](ReceiverModel& law) {
    law.leak_upa = 1e8f;
    law.leak_decay_db_per_m = 200;
    law.leak_is_shared = true;
  });
  s.request.settings.beam_count = 1;
  s.request.switches.noise = false;
  s.request.switches.expected_power = true;
  s.ping();
  ASSERT_EQ(s.beam_sine(0), 0);
  for (const int row : {0, 1, 5, 12, 30})
    EXPECT_NEAR(s.power(row, 0) / (1e16 * power_from_db(-200 * s.range_of_row(row))), 0.02, 0.001) << "its changing part alone";
}

// A sample at range 0 of a leak without shared noise.
TEST(SharedLeak, BeginsAtRangeZero) {
  Sounding s = with([](ReceiverModel& law) {
    law.leak_upa = 1e8f;
    law.leak_decay_db_per_m = 200;
    law.leak_is_shared = true;
  });
  s.request.settings.row_centre = 0;
  s.request.switches.expected_power = true;
  const std::vector<float>& pressure = s.ping().pressure_upa;
  EXPECT_TRUE(std::all_of(pressure.begin(), pressure.end(), [](float p) { return std::isfinite(p); }));
  EXPECT_GT(s.power(0, 40), 1);
}

TEST(SharedNoise, IsRefusedWhereItsTableFitsNoMemory) {
  Sounding s = with([](ReceiverModel& law) { law.shared_noise = {.level_db = 3, .channels = 256, .group = 16, .sine = 0.2f}; });
  s.request.settings.range_bin_count = 20000;
  s.request.settings.beam_count = 512;
  EXPECT_THAT(why_invalid(s.request), ::testing::HasSubstr("would take about 3 times the memory or time allowed"));
  Sounding outside = with([](ReceiverModel& law) { law.shared_noise = {.level_db = 3, .channels = 256, .group = 16}; });
  outside.request.settings.range_bin_count = 20000;
  outside.request.settings.beam_count = 512;
  EXPECT_EQ(why_invalid(outside.request), "");
  s.request.switches.shared_noise = false;
  EXPECT_EQ(why_invalid(s.request), "");
  Sounding endless = with([](ReceiverModel& law) {
    law.shared_noise = {.channels = 4096, .group = 4096};
    law.leak_is_shared = true;
    law.leak_upa = 1;
    law.leak_decay_db_per_m = 0;
  });
  endless.request.settings.range_bin_count = 20000;
  endless.request.settings.beam_count = 512;
  EXPECT_THAT(why_invalid(endless.request), ::testing::HasSubstr("or a leak that ends"));
  endless.request.switches.leak = false;
  EXPECT_EQ(why_invalid(endless.request), "");
  Sounding none = with([](ReceiverModel& law) { law.shared_noise.group = 1; });
  EXPECT_THAT(why_invalid(none.request), ::testing::HasSubstr("shared_noise: group 1 does not fit 128 channels"));
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
  EXPECT_LT(other, 200) << "of 179,200 samples; these lie at the very edge of a code";
  EXPECT_NE(cut.samples, round.samples);
  s.request.switches.truncation = false;
  EXPECT_EQ(s.ping().samples, round.samples);
}

}  // namespace
}  // namespace sonar::test
