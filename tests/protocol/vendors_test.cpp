// Tests the list of vendors: profiles by name, checks of options, and errors that suggest the nearest valid name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "core/text/format.hpp"
#include "protocol/blueview/models.hpp"
#include "protocol/vendor.hpp"

namespace sonar::vendors_test {
namespace {
using testing::HasSubstr;

const protocol::Vendor& oculus() { return *protocol::vendors().front(); }

TEST(Profiles, AreFoundByName) {
  const auto profile = protocol::find_profile("oculus-m1200d");
  ASSERT_TRUE(profile.has_value());
  EXPECT_EQ(profile->vendor->name(), "oculus");
  EXPECT_EQ(profile->model->part_number, 1042);
}

TEST(Profiles, ErrorsNameTheNearest) {
  const auto profile = protocol::find_profile("oculus-m1200");
  ASSERT_FALSE(profile.has_value());
  EXPECT_EQ(profile.error().kind, ErrorKind::config);
  EXPECT_THAT(profile.error().text, HasSubstr("unknown profile 'oculus-m1200'; did you mean \"oculus-m1200d\"?"));
}

TEST(Profiles, NamesAreUnique) {
  std::set<std::string> names;
  for (const protocol::Vendor* vendor : protocol::vendors())
    for (const auto& model : vendor->models()) EXPECT_TRUE(names.insert(model->profile).second) << model->profile;
}

TEST(Options, DefaultsAreFilledIn) {
  const auto options = protocol::check_options(oculus(), {{"gain_echo", "verbatim"}});
  ASSERT_TRUE(options.has_value());
  EXPECT_EQ(options->at("gain_echo"), "verbatim");
  EXPECT_EQ(options->at("before_first_fire"), "dummies");
  EXPECT_EQ(options->size(), oculus().options().size());
}

TEST(Options, DefaultIsTheFirstAllowedValue) {
  for (const protocol::Option& option : oculus().options()) {
    EXPECT_FALSE(option.meaning.empty()) << option.name;
    if (!option.allowed.empty()) {
      EXPECT_EQ(option.allowed.front(), option.default_value) << option.name;
    }
  }
}

TEST(Options, DefaultsPassTheirOwnCheck) {
  const auto defaults = protocol::check_options(oculus(), {});
  ASSERT_TRUE(defaults.has_value());
  EXPECT_TRUE(protocol::check_options(oculus(), *defaults).has_value());
}

TEST(Options, EveryAllowedValuePasses) {
  for (const protocol::Option& option : oculus().options())
    for (const std::string_view value : option.allowed)
      EXPECT_TRUE(protocol::check_options(oculus(), {{std::string(option.name), std::string(value)}}).has_value()) << option.name;
}

TEST(Options, UnknownNameIsRefused) {
  const auto options = protocol::check_options(oculus(), {{"gain_ecko", "auto"}});
  ASSERT_FALSE(options.has_value());
  EXPECT_EQ(options.error().text, "unknown option 'gain_ecko' of oculus; did you mean \"gain_echo\"?");
}

TEST(Options, UnknownValueIsRefused) {
  const auto options = protocol::check_options(oculus(), {{"before_first_fire", "ping"}});
  ASSERT_FALSE(options.has_value());
  EXPECT_EQ(options.error().text, "option before_first_fire cannot be 'ping'; did you mean \"pings\"?");
}

TEST(Options, AWordMayStandForANumber) {
  const auto profile = protocol::find_profile("ping360");
  ASSERT_TRUE(profile.has_value());
  const protocol::Vendor& ping360 = *profile->vendor;
  EXPECT_EQ(protocol::check_options(ping360, {})->at("host_silence_s"), "60");
  EXPECT_TRUE(protocol::check_options(ping360, {{"host_silence_s", "never"}}).has_value());
  EXPECT_TRUE(protocol::check_options(ping360, {{"host_silence_s", "5"}}).has_value());
  const auto wrong = protocol::check_options(ping360, {{"host_silence_s", "always"}});
  ASSERT_FALSE(wrong.has_value());
  EXPECT_EQ(wrong.error().text, "option host_silence_s must be a number from 5 to 600, or never, not 'always'");
}

TEST(Options, WholeNumbersHaveNoFraction) {
  std::set<std::string> whole;
  for (const protocol::Vendor* vendor : protocol::vendors()) {
    for (const protocol::Option& option : vendor->options()) {
      if (!option.whole) continue;
      const std::string name(option.name);
      whole.insert(name);
      const auto with = [&](const std::string& value) { return protocol::check_options(*vendor, {{name, value}}); };
      EXPECT_TRUE(with(std::to_string(static_cast<int>(option.highest))).has_value()) << name;
      for (const std::string& bad : {std::to_string(option.lowest + 0.5), std::string("1e-300")}) {
        ASSERT_FALSE(with(bad).has_value()) << name << ' ' << bad;
        EXPECT_THAT(with(bad).error().text, HasSubstr(name + " must be a whole number from ")) << bad;
      }
    }
  }
  EXPECT_THAT(whole, testing::UnorderedElementsAre("device_type", "header_bytes", "datagram_bytes"));
}

/// A number beyond its limits is refused, not replaced with the nearest limit.
TEST(Options, EveryNumberHasLimits) {
  int numbers = 0;
  for (const protocol::Vendor* vendor : protocol::vendors()) {
    for (const protocol::Option& option : vendor->options()) {
      if (!option.allowed.empty()) continue;
      ++numbers;
      const std::string name(option.name);
      const auto with = [&](double value) { return protocol::check_options(*vendor, {{name, text::format("%.17g", value)}}); };
      ASSERT_LT(option.lowest, option.highest) << name;
      EXPECT_TRUE(with(option.lowest)) << name;
      EXPECT_TRUE(with(option.highest)) << name;
      for (const double beyond : {std::nextafter(option.lowest, -1.0), std::nextafter(option.highest, 1e300), 1e-300, -1e300}) {
        if (beyond >= option.lowest && beyond <= option.highest) continue;
        const auto refused = with(beyond);
        ASSERT_FALSE(refused) << name << ' ' << beyond;
        EXPECT_THAT(refused.error().text, HasSubstr("option " + name + " must be a " + protocol::numbers_of(option))) << beyond;
      }
    }
  }
  EXPECT_GT(numbers, 10);
}

TEST(Options, NumbersMustBeNumbers) {
  EXPECT_TRUE(protocol::check_options(oculus(), {{"dummy_period_ms", "250"}}).has_value());
  for (const char* bad : {"", "fast", "-1", "0", "nan", "inf", "1e999", "250ms", "9.99", "60001"}) {
    const auto options = protocol::check_options(oculus(), {{"dummy_period_ms", bad}});
    ASSERT_FALSE(options.has_value()) << bad;
    EXPECT_THAT(options.error().text, HasSubstr("dummy_period_ms must be a number from 10 to 60000, not '"));
  }
}

// The preset is the case P1 of the benchmarks.
TEST(BlueView, PresetIsTheBenchmarksCase) {
  const auto& model = *blueview::models().front();
  const FrequencyMode& mode = model.modes.front();
  EXPECT_EQ(model.profile, "blueview-p900-90");
  EXPECT_FLOAT_EQ(mode.centre_hz, 900e3f);
  EXPECT_FLOAT_EQ(mode.horizontal_aperture_rad, std::numbers::pi_v<float> / 2);
  EXPECT_EQ(mode.beam_spacing, BeamSpacing::uniform_in_angle);
  EXPECT_EQ(mode.source_level_db, 210);
  EXPECT_EQ(mode.max_range_m, 100);
  EXPECT_EQ(model.max_rate_hz, 15);
}

}  // namespace
}  // namespace sonar::vendors_test
