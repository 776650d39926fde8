// Tests a host's conversation with an emulated Ping1D, without a socket: settings, measurements, streams, refusals, the detector
// and the automatic mode.
#include <gmock/gmock.h>

#include "protocol/ping/ping1d.hpp"
#include "tests/protocol/ping/ping_testing.hpp"

namespace sonar::ping::ping1d {
namespace {

using namespace tests;

template <class T>
Bytes setting(Id id, T value) {
  Bytes payload;
  wire::Writer write(payload);
  write("value", value);
  return framed(id, 0, payload);
}
template <class T>
T value_in(const Frame& frame) {
  T value{};
  wire::Reader reader(frame.payload);
  reader("value", value);
  EXPECT_TRUE(reader.ok() && reader.remaining() == 0);
  return value;
}
std::vector<Id> ids_in(const std::vector<Frame>& frames) {
  std::vector<Id> ids;
  for (const Frame& frame : frames) ids.push_back(frame.header.id);
  return ids;
}

/// Returns a profile of noise with an echo that begins at this row and is `rows` long.
Ping profile_with(const Parameters& parameters, int row, int peak, int rows = 8, int noise = 1) {
  Settings settings;
  settings.parameters = parameters;
  Ping ping;
  ping.request.model = models().front();
  ping.request.settings = ping_settings(settings);
  ping.request.vendor_settings = std::make_shared<HeldSettings>(settings);
  ping.request.number = PingNumber(7);
  ping.samples.assign(200, static_cast<std::byte>(noise));
  for (int i = row; i < std::min(row + rows, 200); ++i) ping.samples[static_cast<std::size_t>(i)] = static_cast<std::byte>(peak);
  return ping;
}

TEST(Ping1D, AnswersHaveTheBytesOfTheDefinitions) {
  Talk talk("ping1d");
  talk.say(hex("42 52 02 00 06 00 00 00 05 00 a1 00"));  // protocol_version, as in the example of the definitions
  talk.say(hex("42 52 00 00 b9 04 00 00 51 01"));  // 1209 is not the number of a message; that of the speed of sound is 1203
  talk.say(hex("42 52 00 00 b4 04 00 00 4c 01"));  // older hosts request the range with its number and no payload
  ASSERT_EQ(talk.replies.size(), 3u);
  EXPECT_EQ(talk.replies[0], hex("42 52 04 00 05 00 01 00 01 00 00 00 9f 00"));
  EXPECT_EQ(frames_in({talk.replies[1]}).at(0).header.id, Id::nack);
  EXPECT_EQ(talk.replies[2], hex("42 52 08 00 b4 04 01 00 00 00 00 00 88 13 00 00 f0 01"));
}

TEST(Ping1D, SettingsAreReadBack) {
  Talk talk("ping1d");
  Bytes all = setting<std::uint8_t>(Id::ping1d_set_mode_auto, 0);  // the requests are in one piece, as in a stream
  for (const Bytes& more : {framed_message(Id::ping1d_set_range, 0, ScanRange{500, 4000}),
                            setting<std::uint32_t>(Id::set_sound_speed_before, 1444000),
                            setting<std::uint16_t>(Id::ping1d_set_interval, 36), setting<std::uint8_t>(Id::ping1d_set_gain, 6),
                            request(Id::ping1d_range), request(Id::ping1d_sound_speed), general(Id::ping1d_interval)})
    all.insert(all.end(), more.begin(), more.end());
  talk.say(all);
  const auto replies = talk.take();
  ASSERT_EQ(replies.size(), 8u);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(replies[i].header.id, Id::ack);
  EXPECT_EQ(message_in<ScanRange>(replies[5]).length_mm, 4000u);
  EXPECT_EQ(value_in<std::uint32_t>(replies[6]), 1444000u);
  EXPECT_EQ(value_in<std::uint16_t>(replies[7]), 36);
  EXPECT_DOUBLE_EQ(talk.settings.range_start_m, 0.5);
  EXPECT_DOUBLE_EQ(talk.settings.range_m, 4.5);
  EXPECT_NEAR(talk.settings.rate_hz, 1000 / 36.0, 1e-3);
  EXPECT_EQ(talk.settings.device_sound_speed_mps, 1444);
  EXPECT_NEAR(talk.settings.gain_db, 20 * std::log10(144), 1e-3);
  for (const Id id : {Id::ping1d_firmware_version, Id::ping1d_device_id, Id::ping1d_voltage_5, Id::ping1d_mode_auto,
                      Id::ping1d_gain, Id::ping1d_transmit_duration, Id::ping1d_general_info, Id::ping1d_processor_temperature,
                      Id::ping1d_pcb_temperature, Id::ping1d_enable, Id::device_information}) {
    talk.say(general(id));
    EXPECT_THAT(ids_in(talk.take()), testing::ElementsAre(id));
  }
  talk.say(setting<std::uint8_t>(Id::ping1d_set_device_id, 43));
  talk.say(request(Id::ping1d_device_id));
  EXPECT_EQ(value_in<std::uint8_t>(talk.take().back()), 43);
}

TEST(Ping1D, ARequestIsAnsweredWithTheNextMeasurement) {
  Talk talk("ping1d");
  EXPECT_EQ(talk.dialogue->next_tick(), Time::max()) << "the device sends nothing without a request";
  talk.say(general(Id::ping1d_distance));
  EXPECT_TRUE(talk.take().empty());
  talk.run_to(5, 0.05);
  EXPECT_EQ(talk.pings, 1);
  EXPECT_THAT(ids_in(talk.take()), testing::ElementsAre(Id::ping1d_distance));
  talk.say(request(Id::ping1d_profile), 5);
  talk.say(request(Id::ping1d_distance_simple), 5);
  talk.run_to(6, 0.05);
  EXPECT_THAT(ids_in(talk.take()), testing::ElementsAre(Id::ping1d_distance_simple, Id::ping1d_profile))
      << "both answers are of one ping";
  EXPECT_EQ(talk.pings, 2);
}

TEST(Ping1D, AStreamContinuesUntilItIsStopped) {
  Talk talk("ping1d");
  talk.say(setting(Id::ping1d_continuous_start, Id::ping1d_profile));
  EXPECT_TRUE(talk.dialogue->hosts_fall_silent());
  EXPECT_THAT(ids_in(talk.take()), testing::ElementsAre(Id::ack));
  EXPECT_EQ(talk.dialogue->next_ping_request(), std::optional(at_s(0)));
  for (int i = 1; i <= 5; ++i) {
    talk.apply(talk.dialogue->on_tick(talk.dialogue->next_tick(), false));
    EXPECT_EQ(talk.pings, i);
    EXPECT_FALSE(talk.dialogue->next_ping_request()) << "only one ping is requested at a time";
    talk.deliver(0.1 * i);
    EXPECT_THAT(ids_in(talk.take()), testing::ElementsAre(Id::ping1d_profile));
  }
  talk.say(setting(Id::ping1d_continuous_stop, Id::ping1d_profile), 1);
  EXPECT_EQ(talk.dialogue->next_tick(), Time::max());
  talk.take();
  talk.say(setting(Id::ping1d_continuous_start, Id::ping1d_range), 1);
  EXPECT_THAT(ids_in(talk.take()), testing::ElementsAre(Id::nack));
}

TEST(Ping1D, APingThatIsLostIsRequestedAgain) {
  Talk talk("ping1d");
  talk.say(setting(Id::ping1d_continuous_start, Id::ping1d_distance));
  talk.apply(talk.dialogue->on_tick(at_s(0), false));
  const auto late = talk.aim.with;
  EXPECT_EQ(talk.dialogue->next_tick(), at_s(2));
  talk.apply(talk.dialogue->on_tick(at_s(2), true));
  EXPECT_EQ(talk.pings, 1) << "no ping is requested while another ping is pending";
  talk.apply(talk.dialogue->on_tick(at_s(4), false));
  EXPECT_EQ(talk.pings, 2);
  EXPECT_FALSE(talk.dialogue->on_ping(late.get(), 0, at_s(4)).prefixes.empty()) << "the late ping is sent when it comes";
}

TEST(Ping1D, NoMeasurementIsMadeWhilePingsAreDisabled) {
  Talk talk("ping1d");
  talk.say(setting(Id::ping1d_continuous_start, Id::ping1d_profile));
  talk.say(setting<std::uint8_t>(Id::ping1d_set_enable, 0));
  EXPECT_EQ(talk.settings.rate_hz, 0);
  EXPECT_EQ(talk.dialogue->next_tick(), Time::max());
  talk.take();
  talk.say(general(Id::ping1d_distance));
  EXPECT_THAT(ids_in(talk.take()), testing::ElementsAre(Id::nack));
  talk.say(setting<std::uint8_t>(Id::ping1d_set_enable, 1), 3);
  EXPECT_EQ(talk.dialogue->next_tick(), at_s(3)) << "the stream continues";
}

TEST(Ping1D, ARequestThatDoesNotChangeEnableKeepsThePingThatIsBeingComputed) {
  for (const auto same : {std::uint8_t{2}, std::uint8_t{1}}) {  // refused, and as it is
    Talk talk("ping1d");
    talk.say(setting(Id::ping1d_continuous_start, Id::ping1d_distance));
    talk.apply(talk.dialogue->on_tick(at_s(0), false));
    talk.say(setting<std::uint8_t>(Id::ping1d_set_enable, same), 0.5);
    EXPECT_EQ(talk.dialogue->next_tick(), at_s(2)) << "no further ping is requested before that ping counts as lost";
  }
}

TEST(Ping1D, RefusesWrongRequests) {
  for (const Bytes& wrong :
       {framed_message(Id::ping1d_set_range, 0, ScanRange{0, 999}),
        framed_message(Id::ping1d_set_range, 0, ScanRange{50000, 50001}),
        framed_message(Id::ping1d_set_range, 0, ScanRange{4294967295u, 4294967295u}),
        setting<std::uint32_t>(Id::set_sound_speed_before, 1500), setting<std::uint8_t>(Id::ping1d_set_gain, 7),
        setting<std::uint8_t>(Id::ping1d_set_mode_auto, 2), setting<std::uint8_t>(Id::ping1d_set_range, 1),
        request(Id::ping1d_goto_bootloader), request(Id::ping1d_set_range), request(Id(1301))}) {
    Talk talk("ping1d");
    talk.say(setting<std::uint8_t>(Id::ping1d_set_mode_auto, 0));
    talk.take();
    talk.say(wrong);
    EXPECT_THAT(ids_in(talk.take()), testing::ElementsAre(Id::nack));
  }
  for (const Bytes& own :
       {framed_message(Id::ping1d_set_range, 0, ScanRange{100, 2000}), setting<std::uint8_t>(Id::ping1d_set_gain, 1)}) {
    Talk talk("ping1d");
    talk.say(own);
    EXPECT_THAT(ids_in(talk.take()), testing::ElementsAre(Id::nack)) << "a setting of the manual mode in automatic mode";
  }
}

TEST(Ping1D, AnOverrideEqualsTheSettingsOfAHost) {
  Talk talk("ping1d");
  const auto changed =
      talk.vendor.apply_override({.range_m = 12, .rate_hz = 4, .gain_percent = 100, .mode = {}, .beams = {}}, talk.state);
  ASSERT_TRUE(changed);
  EXPECT_DOUBLE_EQ(changed->settings.range_m, 12);
  EXPECT_EQ(changed->settings.rate_hz, 4);
  const Parameters p = settings_from(changed->vendor_settings.get()).parameters;
  EXPECT_EQ(p.gain, 6);
  EXPECT_EQ(p.mode_auto, 0);
  EXPECT_FALSE(
      talk.vendor.apply_override({.range_m = 101, .rate_hz = {}, .gain_percent = {}, .mode = {}, .beams = {}}, talk.state));
}

TEST(Ping1DDetector, TheDistanceIsTheBeginningOfTheEcho) {
  Parameters p;
  p.range = {1000, 10000};  // 50 mm for each point
  const Echo echo = find_echo(profile_with(p, 100, 200));
  EXPECT_NEAR(echo.range_m, 1 + 0.05 * 100, 0.026);
  EXPECT_EQ(echo.peak, 200);
  EXPECT_EQ(echo.confidence, 100);
  Ping speckled = profile_with(p, 100, 200);
  speckled.samples[101] = speckled.samples[102] = std::byte{20};
  speckled.samples[105] = std::byte{250};
  EXPECT_NEAR(find_echo(speckled).range_m, echo.range_m, 0.01);
}

TEST(Ping1DDetector, NoiseAloneIsNoEcho) {
  EXPECT_EQ(find_echo(profile_with({}, 50, 0, 8, 0)).confidence, 0);
  EXPECT_EQ(find_echo(profile_with({}, 50, 12, 1, 4)).confidence, 0);
  EXPECT_EQ(find_echo(profile_with({}, 0, 255, 4)).range_m, find_echo(profile_with({}, 0, 1, 4)).range_m)
      << "the device detects nothing nearer than 0.3 m";
}

TEST(Ping1DAutomatic, RangeFollowsTheEcho) {
  Parameters p;
  p.range.length_mm = 10000;
  EXPECT_EQ(adjusted(p, {.range_m = 6, .peak = 150, .confidence = 100}), p) << "a range that suits the echo stays";
  EXPECT_EQ(adjusted(p, {.range_m = 9, .peak = 150, .confidence = 100}).range.length_mm, 15000u);
  EXPECT_EQ(adjusted(p, {.range_m = 0.7, .peak = 150, .confidence = 100}).range.length_mm, 1500u);
  EXPECT_EQ(adjusted(p, {.range_m = 3, .peak = 2, .confidence = 0}).range.length_mm, 20000u)
      << "without an echo, the range grows";
  p.range.length_mm = 100000;
  EXPECT_EQ(adjusted(p, {.range_m = 3, .peak = 2, .confidence = 0}).range.length_mm, 5000u);
}

TEST(Ping1DAutomatic, GainKeepsTheEchoBelowFullScale) {
  Parameters p;
  p.range.length_mm = 10000;
  EXPECT_EQ(adjusted(p, {.range_m = 6, .peak = 255, .confidence = 100}).gain, 2);
  EXPECT_EQ(adjusted(p, {.range_m = 6, .peak = 80, .confidence = 100}).gain, 4);
  EXPECT_EQ(adjusted(p, {.range_m = 6, .peak = 2, .confidence = 0}).gain, 6);
  const double gain_of[] = {0.6, 1.8, 5.5, 12.9, 30.2, 66.1, 144};
  for (int gain = 0; gain <= 6; ++gain)
    for (const double amplitude : {0.05, 0.5, 2.0, 5.0, 17.0, 60.0, 300.0}) {  // strength at gain 1
      p.gain = static_cast<std::uint8_t>(gain);
      const auto next = [&](const Parameters& from) {
        const double peak = std::min(255.0, amplitude * gain_of[from.gain]);
        return adjusted(from, {.range_m = 6, .peak = std::floor(peak), .confidence = 100});
      };
      for (int i = 0; i < 7; ++i) p = next(p);
      EXPECT_EQ(next(p), p) << "the gain does not settle; from gain " << gain << ", amplitude " << amplitude;
    }
}

TEST(Ping1DAutomatic, SettingsFollowAPingUnlessAHostHasChangedThem) {
  Talk talk("ping1d");
  const auto first = settings_from(talk.state.settings.get()).parameters;
  const Ping near = profile_with(first, 20, 150);
  const auto change = talk.vendor.after_ping(near, talk.state);
  ASSERT_TRUE(change);
  EXPECT_LT(change->settings.range_m, 3);
  talk.say(setting<std::uint8_t>(Id::ping1d_set_mode_auto, 0));
  talk.say(framed_message(Id::ping1d_set_range, 0, ScanRange{0, 30000}));
  talk.say(setting<std::uint8_t>(Id::ping1d_set_mode_auto, 1));
  EXPECT_FALSE(talk.vendor.after_ping(near, talk.state)) << "the ping has older settings";
  talk.say(setting<std::uint8_t>(Id::ping1d_set_mode_auto, 0));
  Parameters manual = first;
  manual.range.length_mm = 30000;
  EXPECT_FALSE(talk.vendor.after_ping(profile_with(manual, 20, 150), talk.state));
}

TEST(Ping1D, TheEchoIsDetectedOnce) {
  Talk talk("ping1d");
  Ping ping = profile_with(settings_from(talk.state.settings.get()).parameters, 20, 150);
  const auto said = [&] {
    const auto frame = frames_in(talk.vendor.datagrams(talk.vendor.ports()[1], ping, talk.state)).front();
    const auto next = talk.vendor.after_ping(ping, talk.state);
    return std::tuple(message_in<Profile>(frame).distance_mm, talk.vendor.distance_in(ping)->range_m,
                      next ? next->settings.range_m : 0);
  };
  const auto detected_now = said();
  look_at(ping);
  std::fill(ping.samples.begin(), ping.samples.end(), std::byte{0});
  EXPECT_EQ(said(), detected_now) << "look_at() has stored the echo before the samples were lost";
  look_at(ping);
  EXPECT_NE(said(), detected_now);
}

TEST(Ping1D, AProfileHasTheSettingsOfThePing) {
  Talk talk("ping1d");
  Parameters p;
  p.range = {500, 20000};
  p.gain = 2;
  const Ping ping = profile_with(p, 100, 200);
  const auto frames = talk.vendor.datagrams(talk.vendor.ports()[1], ping, talk.state);
  ASSERT_EQ(frames.size(), 1u) << "a ping without a request is sent as a profile";
  EXPECT_EQ(*talk.vendor.frame(ping, talk.state), frames.front());
  const Frame frame = frames_in(frames).front();
  ASSERT_EQ(frame.payload.size(), 26u + 200);
  const auto profile = message_in<Profile>(frame);
  EXPECT_NEAR(profile.distance_mm, 10500, 60);
  EXPECT_EQ(profile.confidence, 100);
  EXPECT_EQ(profile.transmit_us, 133);
  EXPECT_EQ(profile.ping, 7u);
  EXPECT_EQ(profile.start_mm, 500u);
  EXPECT_EQ(profile.length_mm, 20000u);
  EXPECT_EQ(profile.gain, 2u);
  EXPECT_EQ(profile.count, 200);
  EXPECT_TRUE(std::equal(ping.samples.begin(), ping.samples.end(), frame.payload.begin() + 26));
  for (std::uint8_t gain = 0; gain <= 6; ++gain) {
    p.gain = gain;
    const auto again = frames_in(talk.vendor.datagrams(talk.vendor.ports()[1], profile_with(p, 100, 200), talk.state));
    EXPECT_EQ(message_in<Profile>(again.at(0)).gain, gain);
  }
  const auto place = talk.vendor.region(protocol::Region::image, frames.front());
  ASSERT_TRUE(place);
  EXPECT_EQ(*place, std::pair(std::size_t{34}, std::size_t{200}));
}

}  // namespace
}  // namespace sonar::ping::ping1d
