// Tests a controller's conversation with an emulated ARIS, without a socket.
#include <gmock/gmock.h>

#include <deque>

#include "protocol/aris/aris.hpp"
#include "tests/protocol/aris/aris_testing.hpp"

namespace sonar::aris {
namespace {

using ::testing::HasSubstr;

struct Talk {
  explicit Talk(const char* profile = "aris-3000", protocol::OptionValues options = {}) : state(tests::device(profile, options)) {
    state.last_ping = 17;
    state.settings = vendor().initial_settings(state).vendor_settings;
    state.connected_client = {10, 0, 0, 7};
    dialogue = vendor().converse(vendor().ports().front(), state, tests::at_s(0));
  }
  /// Passes bytes to the dialogue and carries out its events, as the daemon does.
  void say(const Bytes& bytes, double at = 0) {
    const protocol::Reaction reaction = dialogue->on_bytes(bytes, tests::at_s(at));
    EXPECT_TRUE(reaction.replies.empty()) << "the device never answers";
    for (const protocol::Event& event : reaction.events) {
      if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
        changes.push_back(*change);
        if (!late) apply_next();
      } else if (const auto* to = std::get_if<protocol::SetReceivers>(&event)) {
        receivers = to->to;
      } else if (const auto* notice = std::get_if<protocol::Notice>(&event)) {
        notices.push_back(notice->text);
      } else if (const auto* close = std::get_if<protocol::Close>(&event)) {
        closed = close->why;
      }
    }
  }
  void say(const Command& command, double at = 0) { say(framed(command), at); }
  void apply_next() {
    state.settings = changes.front().vendor_settings;
    settings = changes.front().settings;
    changes.pop_front();
  }
  Settings held() const { return settings_from(state.settings.get(), state); }

  protocol::DeviceState state;
  std::unique_ptr<protocol::Dialogue> dialogue;
  PingSettings settings = vendor().initial_settings(tests::device()).settings;
  bool late = false;  // changes of settings wait for apply_next()
  std::deque<protocol::ChangeSettings> changes;
  std::vector<protocol::Endpoint> receivers;
  std::vector<std::string> notices;
  std::string closed;
};

TEST(ArisDialogue, FramesNeedAReceiverAndValidSettings) {
  for (const bool receiver_first : {true, false}) {
    Talk talk;
    if (receiver_first) talk.say(tests::set_receiver(56444));
    EXPECT_EQ(talk.settings.rate_hz, 0);
    talk.say(tests::set_acoustics(tests::acoustics()));
    if (!receiver_first) {
      EXPECT_EQ(talk.settings.rate_hz, 0);
      talk.say(tests::set_receiver(56444));
    }
    EXPECT_EQ(talk.settings.rate_hz, 12);
    ASSERT_EQ(talk.receivers.size(), 1u);
    EXPECT_EQ(talk.receivers[0], (protocol::Endpoint{{}, 56444}))
        << "without an address, frames go to the address of the controller";
    EXPECT_EQ(talk.held().first_ping, 17u);
    EXPECT_EQ(talk.held().applied, 1u);
    EXPECT_EQ(talk.settings.beam_count, 128);
    talk.say(tests::set_receiver(1, "0.0.0.0"));
    EXPECT_EQ(talk.settings.rate_hz, 0);
    EXPECT_TRUE(talk.receivers.empty());
  }
}

Command set_salinity(std::uint32_t psu) {
  Command command;
  command.type = CommandType::set_salinity;
  command.salinity = Choice{psu};
  return command;
}

TEST(ArisDialogue, DelayedCommandsDoNotUndoEachOther) {
  Talk talk;
  talk.late = true;
  talk.say(tests::set_receiver(56444));
  talk.say(tests::set_acoustics(tests::acoustics()));
  talk.apply_next();
  talk.say(set_salinity(15));
  while (!talk.changes.empty()) talk.apply_next();
  EXPECT_EQ(talk.settings.rate_hz, 12);
  EXPECT_EQ(talk.held().salinity, 15u);
  talk.late = false;
  protocol::SettingsOverride wanted;
  wanted.gain_percent = 0;
  talk.state.settings = vendor().apply_override(wanted, talk.state)->vendor_settings;
  talk.say(set_salinity(0));
  EXPECT_EQ(talk.held().acoustics.gain_db, 0) << "the gain is that of the override, not of the last command";
  talk.state.settings = vendor().initial_settings(talk.state).vendor_settings;
  talk.say(tests::set_acoustics(tests::acoustics()));
  EXPECT_EQ(talk.settings.rate_hz, 12) << "the receiver belongs to the connection";
}

TEST(ArisDialogue, ASecondControllerNeitherRenumbersNorStopsTheFrames) {
  Talk talk;
  talk.say(tests::set_receiver(56444));
  talk.say(tests::set_acoustics(tests::acoustics()));
  talk.state.last_ping = 30;
  const auto first = std::exchange(talk.dialogue, vendor().converse(vendor().ports().front(), talk.state, tests::at_s(0)));
  talk.say(set_salinity(0));
  EXPECT_EQ(talk.held().first_ping, 17u);
  EXPECT_EQ(talk.settings.rate_hz, 12);
}

TEST(ArisDialogue, RefusedReceiversStartNothing) {
  Talk talk;
  talk.say(tests::set_receiver(0));
  talk.say(tests::set_receiver(5, "nowhere"));
  talk.say(tests::set_acoustics(tests::acoustics()));
  EXPECT_EQ(talk.settings.rate_hz, 0);
}

TEST(ArisDialogue, RefusedSettingsChangeNothingButTheCookie) {
  Talk talk;
  talk.say(tests::set_receiver(56444, "239.0.0.42"));
  EXPECT_EQ(talk.receivers.at(0), (protocol::Endpoint{{239, 0, 0, 42}, 56444}));
  talk.say(tests::set_acoustics(tests::acoustics(1)));
  const PingSettings before = talk.settings;
  Command keep_alive;
  keep_alive.type = CommandType::ping;
  keep_alive.ping.emplace();
  talk.say(keep_alive);
  Acoustics bad = tests::acoustics(2);
  bad.ping_mode = 1;
  talk.say(tests::set_acoustics(bad));
  talk.say(keep_alive);
  EXPECT_EQ(talk.settings, before);
  EXPECT_EQ(talk.held().invalid, 2u);
  EXPECT_EQ(talk.held().applied, 1u);
  EXPECT_THAT(talk.notices.at(0), HasSubstr("ping mode 1"));
}

TEST(ArisDialogue, SettingsOfEachProductCauseNoWarning) {
  for (const auto& model : vendor().models()) {
    Talk talk(model->profile.c_str());
    const auto host = make_host({});
    ASSERT_TRUE(host);
    const std::uint16_t own[] = {4000, 4001};
    const auto carry_out = [&](const protocol::HostActions& actions) {
      for (const protocol::HostAction& action : actions)
        if (const auto* send = std::get_if<protocol::HostSend>(&action)) talk.say(send->bytes);
    };
    carry_out((*host)->on_open(own, tests::at_s(0)));
    carry_out((*host)->on_tick(tests::at_s(1)));
    EXPECT_GT(talk.settings.rate_hz, 0) << model->profile;
    EXPECT_THAT(talk.notices, testing::IsEmpty()) << model->profile;
  }
}

TEST(ArisDialogue, HostsSetShortRangesOrRefuseThem) {
  for (const double range_m : {0.9, 1.1, 1.2, 1.3, 1.5, 2.0}) {
    Talk talk;
    protocol::Wanted wanted;
    wanted.settings.range_m = range_m;
    const auto host = make_host(wanted);
    ASSERT_EQ(host.has_value(), range_m > 1) << range_m;
    if (!host) continue;
    const std::uint16_t own[] = {4000, 4001};
    for (const protocol::HostAction& action : (*host)->on_open(own, tests::at_s(0)))
      if (const auto* send = std::get_if<protocol::HostSend>(&action)) talk.say(send->bytes);
    EXPECT_NEAR(talk.settings.range_m, range_m, 0.05 * range_m);
    EXPECT_THAT(talk.notices, testing::IsEmpty()) << range_m;
  }
}

TEST(ArisDialogue, SalinityFocusClockAndLensCanBeSet) {
  Talk talk("aris-1800");
  talk.say(tests::set_acoustics({1, 12, 1000, 1360, 5720, 4, 6, 3, true, Frequency::high, true, 18}));
  const float salt = talk.settings.device_sound_speed_mps;
  talk.say(tests::hex("00000004 08 04 32 00"));
  EXPECT_EQ(talk.held().salinity, 0u);
  EXPECT_LT(talk.settings.device_sound_speed_mps, salt - 30);
  Command command;
  command.type = CommandType::set_salinity;
  command.salinity = Choice{20};
  talk.say(command);
  EXPECT_EQ(talk.held().salinity, 0u);
  EXPECT_THAT(talk.notices.back(), HasSubstr("salinity of 20"));
  command = {};
  command.type = CommandType::set_focus;
  command.focus = Focus{0, 5};
  talk.say(command, 3);
  EXPECT_EQ(talk.held().focus_to, 100u);
  EXPECT_EQ(talk.held().focus_set_at, tests::at_s(3));
  command = {};
  command.type = CommandType::set_telephoto;
  command.telephoto = Choice{1};
  talk.say(command);
  EXPECT_NEAR(talk.state.model->modes[static_cast<std::size_t>(talk.settings.mode)].beam_azimuths_rad[0], 0.1296, 1e-3);
  command = {};
  command.date_time = DateTime{"2014-Jan-31 23:58:15"};
  talk.say(command, 10);
  EXPECT_EQ(tests::at_s(10) + talk.held().clock_offset, Time(std::chrono::seconds(1391212695)));
}

TEST(ArisDialogue, TheClockIsSetAlsoAfterAJumpOfSteppedTime) {
  Talk talk;
  talk.state.skipped = std::chrono::seconds(30);
  Command command;
  command.date_time = DateTime{"2014-Jan-31 23:58:15"};
  talk.say(command, 10);
  EXPECT_EQ(tests::at_s(40) + talk.held().clock_offset, Time(std::chrono::seconds(1391212695)))
      << "a ping now has the stamp 40 s";
}

TEST(ArisDialogue, CommandsWithoutEffectAreNamed) {
  Talk talk;
  for (std::uint32_t type = 0; type <= 17; ++type) {
    if (type == static_cast<std::uint32_t>(CommandType::set_acoustics)) continue;
    Command command;
    command.type = static_cast<CommandType>(type);
    talk.notices.clear();
    talk.say(command);
    const bool has_no_effect = type == 7 || (type >= 9 && type <= 13) || type >= 15;
    const auto named = std::ranges::count_if(
        talk.notices, [&](const std::string& text) { return text == "ignored a command of type " + std::to_string(type); });
    EXPECT_EQ(named, has_no_effect ? 1 : 0) << type;
  }
}

TEST(ArisDialogue, WrongDatesAreRefused) {
  EXPECT_EQ(parse_date_time("1970-Jan-01 00:00:01"), Time(std::chrono::seconds(1)));
  for (const char* bad : {"", "2014-01-31 23:58:15", "2014-anF-31 23:58:15", "2014-Feb-30 00:00:00", "2014-Jan-31 24:00:00"})
    EXPECT_FALSE(parse_date_time(bad)) << bad;
}

TEST(ArisDialogue, JunkIsReportedAndAWrongLengthEndsTheConnection) {
  Talk talk;
  talk.say(tests::hex("00000002 FF FF 00000005 08 0E 82 01 00"));
  EXPECT_EQ(talk.notices.size(), 1u);
  EXPECT_EQ(talk.closed, "");
  talk.say(tests::hex("00000002 08 28"));
  EXPECT_THAT(talk.notices.back(), HasSubstr("type 40"));
  talk.say(tests::set_receiver(0));
  talk.say(tests::set_receiver(5, "nowhere"));
  EXPECT_EQ(talk.notices.size(), 4u);
  EXPECT_TRUE(talk.receivers.empty());
  talk.say(tests::hex("7FFFFFFF"));
  EXPECT_THAT(talk.closed, HasSubstr("longer than 4096"));
}

TEST(ArisDialogue, OptionsLimitReceiversAndSilence) {
  Talk talk("aris-3000", {{"receivers", "controller"}, {"silence_s", "5"}});
  talk.say(tests::set_receiver(5, "10.0.0.8"));
  EXPECT_TRUE(talk.receivers.empty());
  talk.say(tests::set_receiver(5, "10.0.0.7"));
  EXPECT_EQ(talk.receivers.size(), 1u);
  EXPECT_EQ(talk.dialogue->longest_silence(), std::chrono::milliseconds(5000));
  EXPECT_EQ(Talk().dialogue->longest_silence(), std::chrono::milliseconds(10000));
}

}  // namespace
}  // namespace sonar::aris
