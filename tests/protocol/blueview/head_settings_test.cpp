#include "protocol/blueview/head_settings.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/protocol/blueview/blueview_testing.hpp"

namespace sonar::blueview {
namespace {

TEST(HeadSettings, EverySetValueIsReadBack) {
  const auto device = test::device();
  SonarSettings all = initial_sonar_settings(device);
  const std::vector<std::pair<Key, Value>> values{{Key::sound_speed, std::int32_t{1490}},
                                                  {Key::gain, 6.5f},
                                                  {Key::tvg, 0.4f},
                                                  {Key::fluid, std::int32_t{1}},
                                                  {Key::transmit, std::int32_t{0}},
                                                  {Key::ping_interval, std::int32_t{100}},
                                                  {Key::dynamic_power, std::int32_t{1}},
                                                  {Key::source_level, 190.0f},
                                                  {Key::local_clock, std::int32_t{1}},
                                                  {Key::name, std::string("bow")}};
  for (const auto& [key, value] : values) {
    ASSERT_TRUE(apply(all, 0, key, value, device).value) << static_cast<int>(key);
    const auto read = read_back(all, 0, key);
    ASSERT_TRUE(read);
    EXPECT_TRUE(read->index() == value.index()) << static_cast<int>(key);
    if (const auto* f = std::get_if<float>(&value)) {
      EXPECT_EQ(std::get<float>(*read), *f);
    }
    if (const auto* i = std::get_if<std::int32_t>(&value)) {
      EXPECT_EQ(std::get<std::int32_t>(*read), *i);
    }
    if (const auto* s = std::get_if<std::string>(&value)) {
      EXPECT_EQ(std::get<std::string>(*read), *s);
    }
  }
}

TEST(HeadSettings, RangesAreLimitedToThoseOfTheProductOrRefused) {
  const auto device = test::device();
  SonarSettings all = initial_sonar_settings(device);
  const auto moved = apply(all, 0, Key::range, FloatPair{0, 500}, device);
  ASSERT_TRUE(moved.value);
  EXPECT_EQ(std::get<FloatPair>(*moved.value).second, 100);
  EXPECT_EQ(std::get<FloatPair>(*moved.value).first, 0) << "hosts pass 0 and ignore the result";
  for (const FloatPair bad : {FloatPair{std::numeric_limits<float>::quiet_NaN(), 5}, FloatPair{1, HUGE_VALF}})
    EXPECT_EQ(apply(all, 0, Key::range, bad, device).refusal.code, Code::bad_parameter);

  const auto strict = test::device("blueview-p900-90", {{"strict_range", "on"}});
  SonarSettings before = initial_sonar_settings(strict);
  const auto refused = apply(before, 0, Key::stop_range, 500.0f, strict);
  EXPECT_FALSE(refused.value);
  EXPECT_EQ(refused.refusal.code, Code::bad_range);
  EXPECT_EQ(before.heads[0].stop_m, initial_sonar_settings(strict).heads[0].stop_m) << "a refused setting changes nothing";
}

TEST(HeadSettings, ALongNameEndsWithAWholeCharacter) {
  const auto device = test::device();
  SonarSettings all = initial_sonar_settings(device);
  const auto named = [&](const std::string& name) {
    apply(all, 0, Key::name, name, device);
    return all.name;
  };
  EXPECT_EQ(named(std::string(63, 'x') + "\u00e9"), std::string(63, 'x'));
  EXPECT_EQ(named(std::string(62, 'x') + "\u00e9y"), std::string(62, 'x') + "\u00e9");
  EXPECT_EQ(named(std::string(62, 'x') + "\u00e9"), std::string(62, 'x') + "\u00e9");
  EXPECT_EQ(named(std::string(70, '\x80')).size(), 0u) << "these bytes begin no character";
}

TEST(HeadSettings, WrongKindsHeadsAndKeysAreRefused) {
  const auto device = test::device();
  SonarSettings all = initial_sonar_settings(device);
  EXPECT_EQ(apply(all, 1, Key::gain, 1.0f, device).refusal.code, Code::no_head);
  EXPECT_EQ(apply(all, -1, Key::gain, 1.0f, device).refusal.code, Code::no_head);
  EXPECT_EQ(apply(all, 0, Key::gain, std::string("loud"), device).refusal.code, Code::bad_parameter);
  EXPECT_EQ(apply(all, 0, Key::name, 1.0f, device).refusal.code, Code::bad_parameter);
  EXPECT_EQ(apply(all, 0, static_cast<Key>(99), 1.0f, device).refusal.code, Code::bad_parameter);
  EXPECT_EQ(apply(all, 0, Key::range, 1.0f, device).refusal.code, Code::bad_parameter);
}

TEST(HeadSettings, TheFirstBinLiesHalfABinBeyondTheStart) {
  for (const float start : {0.0f, 0.5f, 2.0f, 3.21f}) {
    HeadSettings head;
    head.start_m = start;
    head.stop_m = 10;
    const HeadGrid grid = grid_of(head, 0.0254);
    const double first = (grid.skipped + grid.row_centre) * grid.bin_m;
    EXPECT_NEAR(first, static_cast<double>(start) + 0.5 * grid.bin_m, 1e-9) << start;
    EXPECT_NEAR(grid.bins * grid.bin_m, 10 - static_cast<double>(start), grid.bin_m);
  }
  HeadSettings far;
  far.start_m = 0;
  far.stop_m = 100;
  EXPECT_EQ(grid_of(far, 0.0254).bins, 2400) << "for a long range, bins become coarser, not more";
}

TEST(HeadSettings, BecomePingSettings) {
  const auto device = test::device();
  SonarSettings all = initial_sonar_settings(device);
  all.heads[0].gain_db = 3;
  all.heads[0].transmit = 0;
  const PingSettings s = ping_settings(all, device);
  EXPECT_EQ(s.beam_count, 512);
  EXPECT_EQ(s.format.bits, 16);
  EXPECT_TRUE(s.triggered);
  EXPECT_FALSE(s.transmit);
  EXPECT_EQ(s.rate_hz, 15);
  EXPECT_FLOAT_EQ(s.gain_db, ping_settings(initial_sonar_settings(device), device).gain_db + 3);
  all.heads[0].ping_interval_ms = 500;
  EXPECT_FLOAT_EQ(ping_settings(all, device).rate_hz, 2);
  all.heads[0].ping_interval_ms = 1;
  EXPECT_FLOAT_EQ(ping_settings(all, device).rate_hz, 15) << "the rate is limited to that of the product";
}

TEST(HeadSettings, MissingSettingsCountAsTheInitialOnes) {
  const auto device = test::device();
  EXPECT_TRUE(settings_from(nullptr, device).equals(initial_sonar_settings(device)));
}

TEST(HeadSettings, AreEqualIfNoHostGetsADifference) {
  const SonarSettings initial = initial_sonar_settings(test::device());
  SonarSettings other = initial;
  EXPECT_TRUE(other.equals(initial));
  other.heads[0].tvg_db_per_m = 0.5f;
  EXPECT_FALSE(other.equals(initial));
  other = initial;
  other.name = "bow";
  EXPECT_FALSE(other.equals(initial));
}

}  // namespace
}  // namespace sonar::blueview
