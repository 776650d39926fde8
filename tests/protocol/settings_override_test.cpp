// Tests the settings overrides of the control protocol: they must have the same effect as the request of a vendor's client.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <string>

#include "protocol/limits.hpp"
#include "protocol/oculus/fire.hpp"
#include "protocol/ping/omniscan.hpp"
#include "protocol/ping/surveyor.hpp"
#include "protocol/vendor.hpp"
#include "tests/protocol/blueview/blueview_testing.hpp"

namespace sonar::settings_override_test {
namespace {
using testing::HasSubstr;

/// Settings that can be chained: set().range(5).rate(10).
struct Override : protocol::SettingsOverride {
  Override& range(double m) { return range_m = m, *this; }
  Override& rate(double hz) { return rate_hz = hz, *this; }
  Override& gain(double percent) { return gain_percent = percent, *this; }
  Override& of_mode(std::uint32_t index) { return mode = index, *this; }
  Override& with_beams(std::uint32_t count) { return beams = count, *this; }
  Override& bits(std::uint32_t count) { return sample_bits = count, *this; }
  Override& gains_of_rows(bool on) { return row_gains = on, *this; }
};
Override set() { return {}; }

protocol::DeviceState device_of(std::string_view name) {
  const auto profile = protocol::find_profile(name);
  protocol::DeviceState d;
  d.model = profile->model;
  d.options = *protocol::check_options(*profile->vendor, {});
  d.settings = profile->vendor->initial_settings(d).vendor_settings;
  return d;
}
protocol::DeviceState oculus_device() { return device_of("oculus-m1200d"); }
const protocol::Vendor& oculus() { return *protocol::vendors().front(); }

TEST(Overrides, AreRefusedWithThePermittedRangeOfEachProduct) {
  const std::regex ends("the range of .* is ([0-9.e+]+) to ([0-9.e+]+) m.*, not ([-0-9.e+]+) m.*");
  for (const protocol::Vendor* vendor : protocol::vendors())
    for (const auto& model : vendor->models()) {
      SCOPED_TRACE(model->profile);
      const protocol::DeviceState device = device_of(model->profile);
      const auto why = [&](const protocol::SettingsOverride& requested) {
        const auto change = vendor->apply_override(requested, device);
        return change ? std::string() : change.error().text;
      };
      std::smatch found;
      for (const double wrong_m : {-1.0, 1e6}) {
        const std::string refusal = why(set().range(wrong_m));
        ASSERT_TRUE(std::regex_match(refusal, found, ends)) << refusal;
        EXPECT_EQ(why(set().range(1.001 * std::stod(found[1]))), "");
        EXPECT_EQ(why(set().range(0.999 * std::stod(found[2]))), "");
        EXPECT_EQ(std::stod(found[3]), wrong_m);
      }
      EXPECT_THAT(why(set().gain(300)),
                  testing::AnyOf(HasSubstr("the gain must be 0 to 100 %, not 300 %"), HasSubstr("own gain")));
      EXPECT_THAT(why(set().rate(-1)), testing::AnyOf(HasSubstr("not -1 Hz"), HasSubstr("cannot be set"),
                                                      HasSubstr("sets its rate"), HasSubstr("has no rate")));
    }
}

/// Sums of decimal fractions are not exact: 0.2 + 0.1 is above 0.3.
TEST(Overrides, AcceptTheLimitsOfARange) {
  for (int mm = 1; mm < 3000; ++mm) {
    EXPECT_EQ(protocol::range_complaint(0.001 * mm + 0.1, "it", (mm + 100) / 1000.0, 9), "") << mm;
    EXPECT_EQ(protocol::range_complaint((mm + 100) / 1000.0, "it", 0.001 * mm + 0.1, 9), "") << mm;
    EXPECT_EQ(protocol::range_complaint((mm + 100) / 1000.0, "it", 0, 0.001 * mm + 0.1), "") << mm;
    EXPECT_NE(protocol::range_complaint((mm + 99) / 1000.0, "it", 0.001 * mm + 0.1, 9), "") << mm;
  }
}

/// A rate that is too high for the range is not refused; the sonar then pings as fast as it can.
TEST(Overrides, SetNoRateAboveThatOfTheProduct) {
  const std::regex ends("the range of .* is ([0-9.e+]+) to .*");
  for (const protocol::Vendor* vendor : protocol::vendors())
    for (const auto& model : vendor->models()) {
      SCOPED_TRACE(model->profile);
      const protocol::DeviceState device = device_of(model->profile);
      std::smatch found;
      const std::string refusal = vendor->apply_override(set().range(-1), device).error().text;
      ASSERT_TRUE(std::regex_match(refusal, found, ends)) << refusal;
      const double least_m = 1.001 * std::stod(found[1]);
      for (const double rate_hz : {1e6, 1.01 * static_cast<double>(model->max_rate_hz)})
        if (const auto change = vendor->apply_override(set().range(least_m).rate(rate_hz), device)) {
          EXPECT_LE(change->settings.rate_hz, 1.001f * model->max_rate_hz);
        }
    }
}

TEST(Overrides, RefuseARateAboveThatOfTheProduct) {
  const auto why = [](std::string_view profile, double rate_hz) {
    const auto change = protocol::find_profile(profile)->vendor->apply_override(set().rate(rate_hz), device_of(profile));
    return change ? std::string() : change.error().text;
  };
  EXPECT_EQ(why("ping1d", 5000), "the rate of a Ping1D is 0 to 1000 Hz, not 5000 Hz (ping_interval)");
  EXPECT_EQ(why("s500", 5000), "the rate of an S500 is 0 to 10 Hz, not 5000 Hz (msec_per_ping)");
  EXPECT_EQ(why("surveyor-240", 5000), "the rate of a Surveyor is 0 to 99.9 Hz, not 5000 Hz (msec_per_ping)");
  EXPECT_EQ(why("omniscan-450", 5000), "the rate of an Omniscan is 0 to 526.3 Hz, not 5000 Hz (msec_per_ping)");
  EXPECT_EQ(why("norbit-wbms", 5000), "the rate of a Norbit is 0 to 60 Hz, not 5000 Hz (set_rate)");
  EXPECT_EQ(why("m3", 5000), "the rate of an M3 is 0 to 40 Hz, not 5000 Hz");
  EXPECT_EQ(why("oculus-m1200d", 41), "the rate of Oculus M1200d is 0 to 40 Hz, not 41 Hz");
  EXPECT_EQ(why("blueview-p900-90", 16), "the rate of BlueView P900-90 is 0 to 15 Hz, not 16 Hz");
  EXPECT_THAT(why("waterlinked-3d15", 21),
              testing::MatchesRegex("the rate of a Sonar 3D-15 in mode .* is 0 to .* Hz, not 21 Hz"));
  for (const char* profile :
       {"oculus-m1200d", "blueview-p900-90", "ping1d", "s500", "surveyor-240", "omniscan-450", "norbit-wbms", "m3"})
    EXPECT_EQ(why(profile, static_cast<double>(device_of(profile).model->max_rate_hz)), "");
}

/// The highest speed of sound and the shortest range of these sonars give the highest rate, which is that of the product.
TEST(Overrides, KeepTheRateOfTheProductAtTheHighestSpeedOfSound) {
  ping::surveyor::Settings surveyor;
  surveyor.parameters.speed_mps = 2000;
  surveyor.parameters.end_mm = 10;
  surveyor.parameters.period_ms = 0;
  surveyor.parameters.enable = 1;
  EXPECT_FLOAT_EQ(ping::surveyor::ping_settings(surveyor).rate_hz, device_of("surveyor-240").model->max_rate_hz);
  ping::omniscan::Settings omniscan;
  omniscan.speed_mps = 2000;
  omniscan.parameters.length_mm = 100;
  omniscan.parameters.period_ms = 0;
  omniscan.parameters.enable = 1;
  EXPECT_FLOAT_EQ(ping::omniscan::ping_settings(omniscan).rate_hz, device_of("omniscan-450").model->max_rate_hz);
}

TEST(OculusOverride, EqualsTheFireMessageOfADriver) {
  protocol::DeviceState device = oculus_device();
  oculus::FireRequest held = oculus::fire_of(device.settings.get());
  held.settings.gamma = 99;
  held.settings.flags |= oculus::flag::network_trigger;
  held.settings.sound_speed_mps = 1488;
  device.settings = std::make_shared<oculus::HeldFire>(held);

  const auto change = oculus().apply_override(set().range(7.5).rate(14).gain(30), device);
  ASSERT_TRUE(change) << change.error().text;
  const oculus::FireRequest requested = oculus::fire_of(change->vendor_settings.get());
  EXPECT_EQ(requested.settings.range, 7.5);
  EXPECT_EQ(requested.settings.ping_rate, oculus::PingRate::hz15) << "the nearest rate of the table";
  EXPECT_EQ(requested.settings.gain_percent, 30);
  EXPECT_EQ(requested.settings.gamma, 99) << "unset fields stay";
  EXPECT_EQ(requested.settings.sound_speed_mps, 1488);
  EXPECT_TRUE(requested.settings.flags & oculus::flag::network_trigger);
  EXPECT_EQ(change->settings.range_m, 7.5);
  EXPECT_FLOAT_EQ(change->settings.rate_hz, 15);
  EXPECT_TRUE(change->settings.triggered);
}

TEST(OculusOverride, ModesBeamsAndStandbyCanBeSet) {
  const protocol::DeviceState device = oculus_device();
  const auto low = oculus().apply_override(set().of_mode(0).with_beams(256), device);
  ASSERT_TRUE(low);
  EXPECT_EQ(oculus::fire_of(low->vendor_settings.get()).settings.mode, 1);
  EXPECT_EQ(low->settings.mode, 0);
  EXPECT_EQ(low->settings.beam_count, 256);
  const auto still = oculus().apply_override(set().rate(0), device);
  ASSERT_TRUE(still);
  EXPECT_EQ(still->settings.rate_hz, 0);
  const auto far = oculus().apply_override(set().range(30).of_mode(0), device);
  EXPECT_TRUE(far) << "the range is one of the mode in the same request";
}

TEST(OculusOverride, SampleBitsAndRowGainsAreFlags) {
  protocol::DeviceState device = oculus_device();
  const std::uint8_t before = oculus::fire_of(device.settings.get()).settings.flags;
  const auto wide = oculus().apply_override(set().bits(16).gains_of_rows(true), device);
  ASSERT_TRUE(wide);
  EXPECT_EQ(oculus::fire_of(wide->vendor_settings.get()).settings.flags,
            before | oculus::flag::samples_16_bit | oculus::flag::row_gains);
  EXPECT_EQ(wide->settings.format.bits, 16);
  EXPECT_TRUE(wide->settings.format.row_gains);
  device.settings = wide->vendor_settings;
  const auto narrow = oculus().apply_override(set().bits(8).gains_of_rows(false), device);
  ASSERT_TRUE(narrow);
  EXPECT_EQ(oculus::fire_of(narrow->vendor_settings.get()).settings.flags, before);
  EXPECT_FALSE(oculus().apply_override(set().bits(32), device)) << "messages of version 0 cannot request 32 bits";

  oculus::FireRequest held = oculus::fire_of(wide->vendor_settings.get());
  held.version = 2;
  device.settings = std::make_shared<oculus::HeldFire>(held);
  const auto widest = oculus().apply_override(set().bits(32), device);
  ASSERT_TRUE(widest);
  EXPECT_EQ(widest->settings.format.bits, 32);
  device.settings = widest->vendor_settings;
  const auto back = oculus().apply_override(set().bits(16), device);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->settings.format.bits, 16);
}

TEST(OculusOverride, SettingsBeyondTheProductAreRefusedWithThePermittedOnes) {
  const protocol::DeviceState device = oculus_device();
  const auto why = [&](const protocol::SettingsOverride& requested) {
    const auto change = oculus().apply_override(requested, device);
    return change ? "" : change.error().text;
  };
  EXPECT_THAT(why(set().range(11)), HasSubstr("0.1 to 10 m"));
  EXPECT_THAT(why(set().range(0)), HasSubstr("0.1 to 10 m"));
  EXPECT_THAT(why(set().of_mode(2)), HasSubstr("2 mode(s)"));
  EXPECT_THAT(why(set().with_beams(300)), HasSubstr("256 or 512"));
  EXPECT_THAT(why(set().gain(101)), HasSubstr("0 to 100"));
  EXPECT_THAT(why(set().rate(-1)), HasSubstr("the rate must be 0 Hz (standby) or above"));
  EXPECT_THAT(why(set().bits(24)), HasSubstr("8 or 16 bits"));
}

TEST(BlueViewOverride, EqualsTheSettingsOfAHost) {
  protocol::DeviceState device = blueview::test::device();
  blueview::SonarSettings held = blueview::settings_from(device.settings.get(), device);
  held.heads[0].tvg_db_per_m = 0.25f;
  device.settings = std::make_shared<blueview::SonarSettings>(held);
  const auto change = blueview::vendor().apply_override(set().range(25).rate(4).gain(75), device);
  ASSERT_TRUE(change) << change.error().text;
  const blueview::SonarSettings now = blueview::settings_from(change->vendor_settings.get(), device);
  EXPECT_FLOAT_EQ(now.heads[0].stop_m, 25);
  EXPECT_FLOAT_EQ(now.heads[0].start_m, held.heads[0].start_m);
  EXPECT_FLOAT_EQ(now.heads[0].tvg_db_per_m, 0.25f);
  EXPECT_FLOAT_EQ(now.heads[0].gain_db, 24);
  EXPECT_FLOAT_EQ(change->settings.rate_hz, 4);
}

TEST(BlueViewOverride, SettingsBeyondTheProductAreRefusedWithThePermittedOnes) {
  const protocol::DeviceState device = blueview::test::device();
  const auto why = [&](const protocol::SettingsOverride& requested) {
    const auto change = blueview::vendor().apply_override(requested, device);
    return change ? "" : change.error().text;
  };
  EXPECT_THAT(why(set().range(1000)), HasSubstr("not 1000 m (stop_range)"));
  EXPECT_THAT(why(set().range(2.5)), HasSubstr("is 3 to")) << "the range starts at 2 m, and its window is at least 1 m long";
  EXPECT_THAT(why(set().rate(0)), HasSubstr("no standby"));
  EXPECT_THAT(why(set().of_mode(1)), HasSubstr("1 mode(s)"));
  EXPECT_THAT(why(set().with_beams(256)), HasSubstr("512 beams"));
  EXPECT_THAT(why(set().bits(8)), HasSubstr("16 bits"));
  EXPECT_THAT(why(set().gains_of_rows(true)), HasSubstr("no row gains"));
  EXPECT_EQ(why(set().bits(16).gains_of_rows(false)), "") << "the device has these values already";
}

}  // namespace
}  // namespace sonar::settings_override_test
