// Tests valid settings, the values derived from them, and the position of a sample.
#include <gmock/gmock.h>

#include "tests/protocol/aris/aris_testing.hpp"

namespace sonar::aris {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

const Product& product(const std::string& profile) { return product_of(*protocol::find_profile(profile)->model); }

TEST(ArisSettings, HighestFrameRatesAreThoseOfTheVendorsTable) {
  struct Row {
    const char* profile;
    std::uint32_t period, samples, mode;
    double expected_hz;
  };
  for (const Row& row :
       {Row{"aris-3000", 4, 1750, 9, 13.92}, Row{"aris-3000", 4, 4000, 9, 6.7}, Row{"aris-3000", 5, 4000, 9, 5.71},
        Row{"aris-3000", 6, 4000, 9, 4.81}, Row{"aris-1800", 4, 4000, 3, 9.13}, Row{"aris-1800", 5, 4000, 3, 7.61},
        Row{"aris-1800", 6, 4000, 3, 6.41}, Row{"aris-1200", 4, 4000, 1, 15}, Row{"aris-1200", 5, 4000, 1, 15}}) {
    Acoustics a{1, 15, row.samples, 930, 0, row.period, 6, row.mode, true, Frequency::high, true, 12};
    a.cycle_us = shortest_cycle_us(a);
    EXPECT_NEAR(highest_frame_rate_hz(product(row.profile), a, std::nullopt), row.expected_hz, 0.05) << row.profile << row.period;
  }
  EXPECT_LT(highest_frame_rate_hz(product("aris-3000"), tests::acoustics(), 500), 13) << "with a delay between packets";
}

TEST(ArisSettings, SettingsOfTheVendorsSampleProgramAreValidAsTheyAre) {
  for (const char* profile : {"aris-1200", "aris-1800", "aris-3000"}) {
    Acoustics a = product(profile).initial;
    a.cookie = 1;
    const Verdict verdict = judge(a, product(profile), false);
    EXPECT_EQ(verdict.refusal, "") << profile;
    EXPECT_FALSE(verdict.constrained) << profile;
    EXPECT_EQ(verdict.used, a);
  }
}

TEST(ArisSettings, ValuesOutOfRangeAreRefusedByName) {
  const auto why = [](auto change, const char* profile = "aris-3000") {
    Acoustics a = tests::acoustics();
    change(a);
    return judge(a, product(profile), true).refusal;
  };
  EXPECT_EQ(why([](Acoustics&) {}), "");
  EXPECT_THAT(why([](Acoustics& a) { a.cookie = 0; }), HasSubstr("cookie"));
  EXPECT_THAT(why([](Acoustics& a) { a.frame_rate_hz = 0; }), HasSubstr("frame rate 0"));
  EXPECT_THAT(why([](Acoustics& a) { a.frame_rate_hz = std::numeric_limits<float>::quiet_NaN(); }), HasSubstr("frame rate"));
  EXPECT_THAT(why([](Acoustics& a) { a.samples_per_beam = 4097; }), HasSubstr("samples per beam"));
  EXPECT_THAT(why([](Acoustics& a) { a.gain_db = 25; }), HasSubstr("receiver gain"));
  EXPECT_THAT(why([](Acoustics& a) { a.ping_mode = 3; }), HasSubstr("no ping mode 3")) << "a ping mode of another product";
  EXPECT_THAT(why([](Acoustics&) {}, "aris-1800"), HasSubstr("no ping mode 9"));
  EXPECT_THAT(why([](Acoustics& a) { a.cycle_us = 4500; }), HasSubstr("too short"));
  EXPECT_THAT(why([](Acoustics& a) { a.cycle_us = 12000; }), HasSubstr("do not fit"));
}

TEST(ArisSettings, CycleOfTheVendorsLibraryIsAcceptedWhenLenient) {
  const Acoustics a{5, 10, 1024, 2028, 10500, 8, 10, 3, true, Frequency::high, true, 12};
  EXPECT_NE(judge(a, product("aris-1800"), false).refusal, "");
  const Verdict lenient = judge(a, product("aris-1800"), true);
  EXPECT_EQ(lenient.refusal, "");
  EXPECT_TRUE(lenient.constrained);
  EXPECT_EQ(lenient.used.cycle_us, 10580u);
}

TEST(ArisSettings, PulseAndRateAreConstrained) {
  Acoustics a = tests::acoustics();
  a.frame_rate_hz = 15, a.pulse_us = 20;
  Verdict verdict = judge(a, product("aris-3000"), true);
  EXPECT_TRUE(verdict.constrained);
  EXPECT_EQ(verdict.used.pulse_us, 16u) << "240 / 15, which is also the limit of the high frequency";
  a.frequency = Frequency::low;
  EXPECT_EQ(judge(a, product("aris-3000"), true).used.pulse_us, 16u) << "240 / 15";
  a.frame_rate_hz = 10;
  EXPECT_EQ(judge(a, product("aris-3000"), true).used.pulse_us, 20u);
  Acoustics far{2, 7.1f, 4000, 930, 17290, 4, 10, 9, true, Frequency::high, true, 12};
  verdict = judge(far, product("aris-3000"), true);
  EXPECT_EQ(verdict.refusal, "");
  EXPECT_TRUE(verdict.constrained);
  EXPECT_NEAR(verdict.used.frame_rate_hz, 6.7, 0.05);
}

TEST(ArisSettings, CookiesNameAppliedConstrainedAndInvalidSettings) {
  const auto state = tests::device();
  Settings s = initial_settings(state);
  apply(s, tests::acoustics(3), state);
  EXPECT_EQ(s.applied, 3u);
  Acoustics bad = tests::acoustics(4);
  bad.frame_rate_hz = 0;
  apply(s, bad, state);
  EXPECT_EQ(s.invalid, 4u);
  EXPECT_EQ(s.applied, 3u);
  EXPECT_EQ(s.acoustics.frame_rate_hz, 12) << "the old settings stay";
  Acoustics bright = tests::acoustics(5);
  bright.pulse_us = 60;
  apply(s, bright, state);
  EXPECT_EQ(s.constrained, 5u);
  EXPECT_EQ(s.acoustics.pulse_us, 16u);
}

TEST(ArisSettings, RangesOfSamplesFollowFromDelayPeriodAndSoundSpeed) {
  auto state = tests::device();
  state.water = {9, 0, 8, 0};
  Settings s = initial_settings(state);
  s.salinity = 0;
  s.acoustics = {1, 6, 2000, 4593, 32953, 14, 12, 9, true, Frequency::high, true, 24};
  const PingSettings p = ping_settings(s, state);
  const double c = sound_speed_mps(9, 0, 0);
  EXPECT_NEAR(c, 1443.2, 0.1);
  EXPECT_NEAR(p.range_of_row(0), 4593e-6 * c / 2, 1e-9);
  EXPECT_NEAR(p.range_of_row(1999), (4593 + 14 * 1999) * 1e-6 * c / 2, 1e-9);
  EXPECT_EQ(p.range_bin_count, 2000);
  s.salinity = 35;
  const double salt = static_cast<double>(ping_settings(s, state).device_sound_speed_mps) / c;
  EXPECT_NEAR(salt, 1.029, 0.003) << "a wrong salinity scales the ranges";
}

TEST(ArisSettings, FocusMovesAtTheSpeedOfItsMotor) {
  Settings s;
  s.focus_from = 200, s.focus_to = 700, s.focus_set_at = tests::at_s(1);
  EXPECT_EQ(focus_at(s, tests::at_s(1.25)).position, 450u);
  EXPECT_TRUE(focus_at(s, tests::at_s(1.25)).moves);
  EXPECT_EQ(focus_at(s, tests::at_s(1.6)).position, 700u);
  EXPECT_FALSE(focus_at(s, tests::at_s(1.6)).moves);
}

TEST(ArisOverride, EqualsTheSettingsOfAController) {
  const auto state = tests::device();
  const auto change = [&](const protocol::SettingsOverride& wanted) { return vendor().apply_override(wanted, state); };
  const auto far = change({12, 5, 50, {}, {}});
  ASSERT_TRUE(far) << far.error().text;
  EXPECT_NEAR(far->settings.range_m, 12, 0.01);
  EXPECT_EQ(far->settings.gain_db, 12);
  EXPECT_EQ(far->settings.beam_count, 128);
  const auto long_range = change({20, 5, {}, {}, {}});
  ASSERT_TRUE(long_range) << long_range.error().text;
  EXPECT_GE(static_cast<double>(long_range->settings.pulse_width_m), 0.99 * 0.5858 * long_range->settings.range_bin_m)
      << "a tone as long as a row";
  const auto few = change({{}, {}, {}, {}, 64u});
  ASSERT_TRUE(few) << few.error().text;
  EXPECT_EQ(few->settings.beam_count, 64);
  const auto why = [&](const protocol::SettingsOverride& wanted) {
    const auto result = change(wanted);
    return result ? "" : result.error().text;
  };
  protocol::SettingsOverride wanted;
  wanted.beams = 100;
  EXPECT_THAT(why(wanted), HasSubstr("forms 64 or 128 beams, not 100"));
  EXPECT_THAT(why({30, {}, {}, {}, {}}), HasSubstr("to 20 m, not 30 m"));
  EXPECT_THAT(why({{}, 0, {}, {}, {}}), HasSubstr("1 to 15"));
  EXPECT_THAT(why({{}, {}, 101, {}, {}}), HasSubstr("0 to 100"));
  EXPECT_THAT(why({{}, {}, {}, 9u, {}}), HasSubstr("4 mode(s)"));
}

TEST(ArisOverride, RefusalNamesOnlyTheBeamsOfTheRequestedMode) {
  const auto state = tests::device();
  for (const std::uint32_t mode : {0u, 1u, 2u, 3u}) {
    const auto in_mode = vendor().apply_override({{}, {}, {}, mode, {}}, state);
    ASSERT_TRUE(in_mode) << in_mode.error().text;
    const int beams = in_mode->settings.beam_count, others = 64 + 128 - beams;
    const auto result = vendor().apply_override({{}, {}, {}, mode, static_cast<std::uint32_t>(others)}, state);
    ASSERT_FALSE(result);
    EXPECT_THAT(result.error().text,
                EndsWith("forms " + std::to_string(beams) + " beams in this mode, not " + std::to_string(others)));
  }
}

}  // namespace
}  // namespace sonar::aris
