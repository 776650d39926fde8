// Tests a host's conversation with an emulated Omniscan 450, without a socket: sessions, profiles, refusals.
#include <gmock/gmock.h>

#include <limits>

#include "protocol/ping/omniscan.hpp"
#include "tests/protocol/ping/ping_testing.hpp"

namespace sonar::ping::omniscan {
namespace {

using namespace tests;

Bytes pings(OsPingParams p = {.enable = 1}) { return framed_message(Id::os_ping_params, 0, p); }

TEST(Omniscan, TheEnableFieldStartsAndEndsTheSession) {
  Talk talk("omniscan-450");
  talk.say(general(Id::device_information));
  ASSERT_EQ(talk.take().size(), 1u);
  EXPECT_EQ(talk.settings.rate_hz, 0);
  EXPECT_EQ(talk.dialogue->next_tick(), Time::max()) << "the device sends nothing without a request";
  talk.say(pings());
  EXPECT_GE(talk.settings.rate_hz, 2.5) << "hosts wait only half a second for a profile of 5 m";
  EXPECT_NEAR(talk.settings.rate_hz, 1 / (10 / 1500.0 + 0.0018), 1e-3) << "the travel time limits the rate";
  talk.say(pings({.start_mm = 2000, .length_mm = 30000, .period_ms = 200, .results = 1200, .enable = 1}));
  EXPECT_EQ(talk.settings.rate_hz, 5);
  EXPECT_DOUBLE_EQ(talk.settings.range_start_m, 2);
  EXPECT_DOUBLE_EQ(talk.settings.range_bin_m, 0.025);
  talk.say(pings({.enable = 0}));
  EXPECT_EQ(talk.settings.rate_hz, 0);
  EXPECT_TRUE(talk.take().empty());
}

TEST(Omniscan, BothSizesOfSettingsAndBothMessagesOfTheSpeedOfSoundAreAccepted) {
  Talk talk("omniscan-450");
  Bytes payload = wire::bytes_of(OsPingParams{.length_mm = 7000, .enable = 1});
  EXPECT_EQ(payload.size(), 34u);
  payload.resize(36);
  talk.say(framed(Id::os_ping_params, 0, payload));
  EXPECT_DOUBLE_EQ(talk.settings.range_m, 7);
  talk.say(framed_message(Id::set_sound_speed, 0, SoundSpeed{1450000}));
  EXPECT_EQ(talk.settings.device_sound_speed_mps, 1450);
  talk.say(framed_message(Id::set_sound_speed_before, 0, SoundSpeed{1480000}));
  EXPECT_EQ(talk.settings.device_sound_speed_mps, 1480);
  EXPECT_DOUBLE_EQ(talk.settings.range_m, 7) << "the other settings stay";
  EXPECT_TRUE(talk.take().empty());
}

TEST(Omniscan, AProfileHasTheSettingsOfThePing) {
  Talk talk("omniscan-450");
  talk.state.powered_up_at = at_s(0);
  talk.say(pings({.start_mm = 500, .length_mm = 5000, .gain = 3, .results = 700, .enable = 1}));
  Ping ping;
  ping.request.settings = talk.settings;
  ping.request.vendor_settings = talk.state.settings;
  ping.request.fired_at = at_s(2.5);
  ping.request.number = PingNumber(1);
  ping.request.sonar_in_world.orientation = quat_from_rpy({0, 0, -pi / 2});  // the sonar looks to the south
  for (int i = 0; i < 700; ++i)
    for (const int part : {i & 0xFF, i >> 8}) ping.samples.push_back(static_cast<std::byte>(part));
  const auto datagrams = talk.vendor.datagrams(talk.vendor.ports()[1], ping, talk.state);
  ASSERT_EQ(datagrams.size(), 1u);
  EXPECT_EQ(*talk.vendor.frame(ping, talk.state), datagrams.front());
  const Frame frame = frames_in(datagrams).front();
  EXPECT_EQ(frame.header.id, Id::os_mono_profile);
  EXPECT_EQ(frame.payload.size(), 52u + 2 * 700);
  const auto profile = message_in<OsMonoProfile>(frame);
  EXPECT_EQ(profile.ping, 0u);
  EXPECT_EQ(profile.start_mm, 500u);
  EXPECT_EQ(profile.length_mm, 5000u);
  EXPECT_EQ(profile.power_up_ms, 2500u);
  EXPECT_EQ(profile.hz, 450000u);
  EXPECT_EQ(profile.gain, 3);
  EXPECT_EQ(profile.results, 700);
  EXPECT_EQ(profile.speed_dmps, 15000);
  EXPECT_NEAR(static_cast<double>(profile.pulse_s), 2 * 0.002 * 5.5 / 1500, 1e-9);
  EXPECT_NEAR(static_cast<double>(profile.transducer_heading_deg), 180, 1e-3);
}

/// Returns the profile of a ping with these samples, and its powers.
std::pair<OsMonoProfile, std::vector<std::uint16_t>> profile_of_samples(const std::vector<std::uint16_t>& samples) {
  Talk talk("omniscan-450");
  talk.say(pings({.results = 200, .enable = 1}));
  Ping ping;
  ping.request.settings = talk.settings;
  ping.request.vendor_settings = talk.state.settings;
  ping.request.number = PingNumber(1);
  for (const int sample : samples)
    for (const int part : {sample & 0xFF, sample >> 8}) ping.samples.push_back(static_cast<std::byte>(part));
  const Frame frame = frames_in({profile_of(ping, talk.state)}).front();
  std::vector<std::uint16_t> powers(samples.size());
  wire::Reader reader(BytesView(frame.payload).subspan(52));
  for (std::uint16_t& power : powers) reader("power", power);
  EXPECT_TRUE(reader.ok() && reader.remaining() == 0);
  return {message_in<OsMonoProfile>(frame), powers};
}

/// In 9,020 profiles of a real device the lowest power is 0, the highest 65535, and the limits in dB differ from ping to ping.
TEST(Omniscan, TheLowestAndHighestPowerOfAPingAreItsScale) {
  std::vector<std::uint16_t> samples(200, 30000);  // a step is 160 dB / 65535
  samples[7] = 20000;
  samples[150] = 40000;
  const auto [profile, powers] = profile_of_samples(samples);
  EXPECT_EQ(powers[7], 0);
  EXPECT_EQ(powers[150], 65535);
  EXPECT_EQ(powers[0], 32768);
  const double step_db = 160.0 / 65535;
  EXPECT_NEAR(static_cast<double>(profile.lowest_db), -80 + 20000 * step_db, 1e-4);
  EXPECT_NEAR(static_cast<double>(profile.highest_db), -80 + 40000 * step_db, 1e-4);
}

TEST(Omniscan, APingOfOnePowerHasThisPowerAsScale) {
  const auto [profile, powers] = profile_of_samples(std::vector<std::uint16_t>(200, 65535));
  EXPECT_EQ(profile.lowest_db, 80);
  EXPECT_EQ(profile.highest_db, 80);
  EXPECT_EQ(powers, std::vector<std::uint16_t>(200, 0));
}

TEST(Omniscan, ARequestIsAnsweredWithTheNextProfile) {
  Talk talk("omniscan-450");
  talk.say(general(Id::os_mono_profile));
  EXPECT_EQ(talk.take().at(0).header.id, Id::nack) << "no pings are enabled";
  talk.say(pings());
  talk.say(general(Id::os_mono_profile));
  EXPECT_TRUE(talk.take().empty());
}

TEST(Omniscan, RefusesWrongRequests) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const OsPingParams& p :
       {OsPingParams{.length_mm = 0}, OsPingParams{.start_mm = 4294967295u, .length_mm = 4294967295u}, OsPingParams{.gain = 8},
        OsPingParams{.results = 199}, OsPingParams{.results = 1201}, OsPingParams{.pulse_part = nan}}) {
    Talk talk("omniscan-450");
    talk.say(pings(p));
    EXPECT_EQ(talk.take().at(0).header.id, Id::nack);
  }
  for (std::uint32_t start_mm = 0; start_mm < 150000; ++start_mm) {
    ASSERT_EQ(complaint({.start_mm = start_mm, .length_mm = 150000 - start_mm}).empty(), start_mm <= 149900) << start_mm;
    ASSERT_NE(complaint({.start_mm = start_mm, .length_mm = 150001 - start_mm}), "") << start_mm;
  }
  Talk talk("omniscan-450");
  talk.say(framed_message(Id::set_sound_speed, 0, SoundSpeed{1500}));
  EXPECT_EQ(talk.take().at(0).header.id, Id::nack);
}

TEST(Omniscan, AnOverrideEqualsTheSettingsOfAHost) {
  Talk talk("omniscan-450");
  protocol::SettingsOverride wanted;
  wanted.range_m = 12;
  wanted.rate_hz = 4;
  wanted.gain_percent = 100;
  const auto changed = talk.vendor.apply_override(wanted, talk.state);
  ASSERT_TRUE(changed);
  EXPECT_DOUBLE_EQ(changed->settings.range_m, 12);
  EXPECT_EQ(changed->settings.rate_hz, 4);
  EXPECT_EQ(changed->settings.gain_db, 42);
  wanted.range_m = 1000;
  EXPECT_FALSE(talk.vendor.apply_override(wanted, talk.state));
}

}  // namespace
}  // namespace sonar::ping::omniscan
