// What is wished of a sonar by nobody's protocol (control, for one): as a client of the vendor would have asked for it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/oculus/fire.hpp"
#include "protocol/vendor.hpp"
#include "tests/protocol/blueview/blueview_testing.hpp"

namespace {

using namespace sonar;
using testing::HasSubstr;

/// One knob after the other: wish().range(5).rate(10).
struct Asked : protocol::Wish {
  Asked& range(double m) { return range_m = m, *this; }
  Asked& rate(double hz) { return rate_hz = hz, *this; }
  Asked& gain(double percent) { return gain_percent = percent, *this; }
  Asked& of_mode(std::uint32_t index) { return mode = index, *this; }
  Asked& with_beams(std::uint32_t count) { return beams = count, *this; }
};
Asked wish() { return {}; }

protocol::DeviceState oculus_device() {
  const auto profile = protocol::find_profile("oculus-m1200d");
  protocol::DeviceState d;
  d.model = profile->model;
  d.options = *protocol::check_options(*profile->vendor, {});
  d.request = profile->vendor->initial_settings(d).request;
  return d;
}
const protocol::Vendor& oculus() { return *protocol::vendors().front(); }

TEST(OculusWish, IsTheFireMessageThatADriverWouldHaveSent) {
  protocol::DeviceState device = oculus_device();
  oculus::FireRequest held = *oculus::parse_fire(device.request);
  held.settings.gamma = 99;
  held.settings.flags |= oculus::flag::network_trigger;
  held.settings.sound_speed_mps = 1488;
  device.request = oculus::make_fire(held);

  const auto change = oculus().wished(wish().range(7.5).rate(14).gain(30), device);
  ASSERT_TRUE(change) << change.error().text;
  const auto asked = oculus::parse_fire(change->request);
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->settings.range, 7.5);
  EXPECT_EQ(asked->settings.ping_rate, oculus::PingRate::hz15) << "the nearest of the table";
  EXPECT_EQ(asked->settings.gain_percent, 30);
  EXPECT_EQ(asked->settings.gamma, 99) << "what is not wished stays";
  EXPECT_EQ(asked->settings.sound_speed_mps, 1488);
  EXPECT_TRUE(asked->settings.flags & oculus::flag::network_trigger);
  EXPECT_EQ(change->settings.range_m, 7.5);
  EXPECT_FLOAT_EQ(change->settings.rate_hz, 15);
  EXPECT_TRUE(change->settings.triggered);
}

TEST(OculusWish, ModesBeamsAndStandby) {
  const protocol::DeviceState device = oculus_device();
  const auto low = oculus().wished(wish().of_mode(0).with_beams(256), device);
  ASSERT_TRUE(low);
  EXPECT_EQ(oculus::parse_fire(low->request)->settings.mode, 1);
  EXPECT_EQ(low->settings.mode, 0);
  EXPECT_EQ(low->settings.beam_count, 256);
  const auto still = oculus().wished(wish().rate(0), device);
  ASSERT_TRUE(still);
  EXPECT_EQ(still->settings.rate_hz, 0);
  const auto far = oculus().wished(wish().range(30).of_mode(0), device);
  EXPECT_TRUE(far) << "the range of the mode that is wished with it";
}

TEST(OculusWish, WhatTheProductCannotDoIsRefusedWithWhatItCan) {
  const protocol::DeviceState device = oculus_device();
  const auto why = [&](const protocol::Wish& asked) {
    const auto change = oculus().wished(asked, device);
    return change ? "" : change.error().text;
  };
  EXPECT_THAT(why(wish().range(11)), HasSubstr("0.1 to 10 m"));
  EXPECT_THAT(why(wish().range(0)), HasSubstr("0.1 to 10 m"));
  EXPECT_THAT(why(wish().of_mode(2)), HasSubstr("2 mode(s)"));
  EXPECT_THAT(why(wish().with_beams(300)), HasSubstr("256 or 512"));
  EXPECT_THAT(why(wish().gain(101)), HasSubstr("0 to 100"));
  EXPECT_THAT(why(wish().rate(-1)), HasSubstr("0 (standby) or above"));
}

TEST(BlueViewWish, IsWhatAHostWouldHaveSet) {
  protocol::DeviceState device = blueview::test::device();
  blueview::SonarSettings held = blueview::settings_from(device.request, device);
  held.heads[0].tvg_db_per_m = 0.25f;
  device.request = blueview::bytes_of_settings(held);
  const auto change = blueview::vendor().wished(wish().range(25).rate(4).gain(75), device);
  ASSERT_TRUE(change) << change.error().text;
  const blueview::SonarSettings now = blueview::settings_from(change->request, device);
  EXPECT_FLOAT_EQ(now.heads[0].stop_m, 25);
  EXPECT_FLOAT_EQ(now.heads[0].start_m, held.heads[0].start_m);
  EXPECT_FLOAT_EQ(now.heads[0].tvg_db_per_m, 0.25f);
  EXPECT_FLOAT_EQ(now.heads[0].gain_db, 24);
  EXPECT_FLOAT_EQ(change->settings.rate_hz, 4);
}

TEST(BlueViewWish, WhatTheProductCannotDoIsRefusedWithWhatItCan) {
  const protocol::DeviceState device = blueview::test::device();
  const auto why = [&](const protocol::Wish& asked) {
    const auto change = blueview::vendor().wished(asked, device);
    return change ? "" : change.error().text;
  };
  EXPECT_THAT(why(wish().range(1000)), HasSubstr("sees from"));
  EXPECT_THAT(why(wish().range(1)), HasSubstr("starts at 2 m"));
  EXPECT_THAT(why(wish().rate(0)), HasSubstr("no standby"));
  EXPECT_THAT(why(wish().of_mode(1)), HasSubstr("1 mode(s)"));
  EXPECT_THAT(why(wish().with_beams(256)), HasSubstr("512 beams"));
}

}  // namespace
