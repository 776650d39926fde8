// Tests the host of each make with the device of the same make, in memory and virtual time. Settings must have effect and pings
// must arrive for any split of the bytes. Cut or foreign bytes must cause neither a ping nor a crash.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "core/image/draw_picture.hpp"
#include "core/text/format.hpp"
#include "tests/is_sanitized.hpp"
#include "tests/protocol/hosts_testing.hpp"

namespace sonar::protocol::hosts_test {
namespace {

using testing::HasSubstr;

INSTANTIATE_TEST_SUITE_P(OfEveryMake, Hosts, testing::ValuesIn(makes().begin(), makes().end()),
                         [](const auto& of) { return std::string(of.param.name()); });

TEST_P(Hosts, SendSettingsAndGetPings) {
  const Make& make = GetParam();
  const Wanted wanted = all_that_is_known(make, range_m);
  Talk talk(make, wanted, 0, model_of(make));
  talk.run(30);
  ASSERT_FALSE(talk.error) << talk.error->text;
  EXPECT_TRUE(talk.host->is_open());
  EXPECT_NEAR(talk.settings.range_m, range_m, 0.3) << "the range is that of `sonarctl set sonar --range`";
  if (wanted.settings.gain_percent) {
    EXPECT_NEAR(make.device->gain_percent(talk.state), 50, make.scans ? 50 : 8) << "a Ping360 has three steps";
  }
  if (wanted.settings.rate_hz && !make.each_ping_requested) {
    EXPECT_NEAR(talk.settings.rate_hz, 5, 0.3);
  }
  ASSERT_GT(talk.pings.size(), 2u);
  const HostPing& ping = talk.pings.back();
  EXPECT_THAT(ping.errors, testing::IsEmpty());
  EXPECT_THAT(ping.echo_mismatches, testing::IsEmpty());
  EXPECT_THAT(ping.limited, testing::Each(testing::StartsWith("gain ")))
      << "only the gain may be limited, because it may have steps";
  EXPECT_NEAR(ping.facts.range_m, make.name() == "waterlinked" ? range_m : talk.settings.range_m, 0.2);
  EXPECT_GT(ping.facts.message_size, 50u);
  const auto picture = ping.picture();
  if (!picture) {
    EXPECT_THAT(picture.error().text, HasSubstr("picture"));
  } else {
    EXPECT_GT(picture->rows, 10u);
    EXPECT_EQ(picture->samples.size(), picture->rows * picture->beams);
    EXPECT_EQ(picture->azimuth_rad.size(), picture->beams);
  }
  const auto drawing = drawing_of(ping);
  ASSERT_TRUE(drawing) << drawing.error().text;
  EXPECT_EQ(drawing->kind, make.picture);
  EXPECT_NEAR(drawing->range_m(), ping.facts.range_m, 0.01);
  const FanStyle style{200, *find_colour_map("gray"), true};
  const auto raster = PicturePainter(style).draw(*drawing);
  ASSERT_TRUE(raster) << raster.error().text;
  EXPECT_EQ(raster->height, picture_height(*drawing, style));
}

TEST_P(Hosts, ReportTheTrueRangeInsteadOfTheEchoedOne) {
  Wanted wanted;
  wanted.settings.range_m = 900;  // beyond the range of every sonar
  if (!GetParam().host(wanted)) return;
  Talk talk(GetParam(), wanted, 0, model_of(GetParam()));
  talk.run(30);
  if (GetParam().name() == "oculus") {
    ASSERT_FALSE(talk.error) << talk.error->text;
    ASSERT_TRUE(talk.host->expects_echo());
    ASSERT_FALSE(talk.pings.empty());
  }
  if (talk.pings.empty() || !talk.host->expects_echo()) return;  // the host refuses, or reports only the range of each ping
  const HostPing& ping = talk.pings.back();
  EXPECT_LT(ping.facts.range_m, 899);
  EXPECT_THAT(ping.echo_mismatches, testing::IsEmpty());
  EXPECT_THAT(ping.limited, testing::Contains(HasSubstr("not 900 m")));
}

/// Users type metres and do not know the fields of messages.
TEST_P(Hosts, RefuseARangeWithTheLimitsInMetres) {
  const auto& model = *GetParam().device->models()[model_of(GetParam())];
  for (const double wanted_m : {900.0, 0.001, static_cast<double>(model.modes.front().max_range_m)}) {
    Wanted wanted;
    wanted.settings.range_m = wanted_m;
    const auto host = GetParam().host(wanted);
    std::string why = host ? "" : host.error().text;
    if (host) {
      Talk talk(GetParam(), wanted, 0, model_of(GetParam()));
      talk.run(30);
      if (!talk.error && !talk.pings.empty()) continue;  // the sonar has limited the range
      why = talk.error ? talk.error->text : "";
    }
    if (why.find("--range") != std::string::npos) continue;  // this make has no such setting
    EXPECT_THAT(why, testing::MatchesRegex(".*range[^_]* m([^a-z].*)?")) << wanted_m;
  }
}

/// A host that gets no pings has an error, for every model and for extreme values that a user can type.
TEST_P(Hosts, NameTheReasonForMissingPings) {
  std::vector<Wanted> all;
  const auto add = [&all](auto setting, auto... values) { ((all.emplace_back().settings.*setting = values), ...); };
  add(&SettingsOverride::range_m, 0.0, 1e-3, 0.5, 1.0, 15.0, 21.0, 60.0, 99.0, 120.0, 250.0, 600.0, 1e5);
  add(&SettingsOverride::rate_hz, 1e-3, 1.0, 70.0, 5000.0, 1e9);
  add(&SettingsOverride::gain_percent, 0.0, 1.0, 100.0);
  add(&SettingsOverride::mode, 0u, 1u, 2u, 3u, 4u, 5u, 8u, 98u);
  for (const double range_m : {0.5, 60.0})
    for (const double rate_hz : {1e-3, 5000.0}) {
      SettingsOverride& both = all.emplace_back().settings;
      both.range_m = range_m, both.rate_hz = rate_hz, both.gain_percent = 100;
    }
  if (sets_nothing(GetParam())) return;
  for (std::size_t model = 0; model < GetParam().device->models().size(); ++model)
    for (const Wanted& wanted : all) {
      if (!GetParam().host(wanted)) continue;
      Talk talk(GetParam(), wanted, 0, model);
      for (int i = 0; i < 30 && talk.pings.empty() && !talk.error; ++i) talk.run(1);
      const SettingsOverride& s = wanted.settings;
      EXPECT_TRUE(talk.error ? !talk.error->text.empty() : !talk.pings.empty())
          << talk.state.model->profile
          << text::format(": range %g m, rate %g Hz, gain %g %%, mode %u", s.range_m.value_or(-1), s.rate_hz.value_or(-1),
                          s.gain_percent.value_or(-1), s.mode.value_or(0));
    }
}

TEST_P(Hosts, FindASonarWithSettingsThatItsModelHas) {
  Wanted nothing;
  nothing.as_it_is = true;
  const Vendor& device = *GetParam().device;
  for (std::size_t i = 0; i < device.models().size(); ++i) {
    Talk talk(GetParam(), nothing, 0, i);
    SCOPED_TRACE(talk.state.model->profile);
    const PingSettings& s = talk.settings;
    ASSERT_GE(s.mode, 0);
    ASSERT_LT(static_cast<std::size_t>(s.mode), talk.state.model->modes.size());
    const FrequencyMode& mode = talk.state.model->modes[static_cast<std::size_t>(s.mode)];
    EXPECT_GT(s.beam_count, 0);
    EXPECT_GT(s.range_bin_count, 0);
    EXPECT_GT(s.range_m, s.range_start_m);
    EXPECT_LE(s.range_m, 1.01 * static_cast<double>(mode.max_range_m));
    EXPECT_NEAR(s.range_start_m + s.range_bin_count * s.range_bin_m, s.range_m, 1.01 * s.range_bin_m);
    EXPECT_GE(s.rate_hz, 0);
    EXPECT_GE(device.gain_percent(talk.state), 0);
    EXPECT_LE(device.gain_percent(talk.state), 100);
    const auto same = device.apply_override({}, talk.state);
    ASSERT_TRUE(same) << same.error().text;
    EXPECT_TRUE(same->vendor_settings->equals(*talk.state.settings)) << same->summary;
  }
}

TEST_P(Hosts, ShowAnEchoToPortAtPort) {
  Talk talk(GetParam(), all_that_is_known(GetParam(), range_m), 0, model_of(GetParam()));
  talk.only_port = true;
  talk.run(6);
  ASSERT_FALSE(talk.pings.empty());
  const auto drawing = drawing_of(talk.pings.back());
  ASSERT_TRUE(drawing) << drawing.error().text;
  if (drawing->kind == PictureKind::waterfall) return;  // it has one beam
  if (drawing->kind == PictureKind::sweep) {
    EXPECT_NEAR(std::remainder(drawing->head_rad - talk.head_rad, 2 * pi), 0, 0.02);
    return;
  }
  const PolarImage& image = drawing->image;
  std::size_t port = 0, starboard = 0;
  for (const auto& [azimuth_rad, at_m] : drawing->points) ++(azimuth_rad > 0 ? port : starboard);
  for (std::size_t i = 0; drawing->points.empty() && i < image.samples.size(); ++i)
    if (image.samples[i] > 0) ++(image.azimuth_rad[i % image.beams] > 0 ? port : starboard);
  EXPECT_GT(port, 0u);
  EXPECT_EQ(starboard, 0u);
}

TEST_P(Hosts, ReadTheSamePingsHoweverAStreamIsSplit) {
  const auto pings_of = [](std::size_t piece) {
    Talk talk(GetParam(), all_that_is_known(GetParam(), range_m), piece, model_of(GetParam()));
    talk.run(sonar::test::is_sanitized && !GetParam().scans ? 3 : 6);  // single bytes take long under sanitizers
    std::vector<std::pair<std::uint32_t, std::vector<float>>> all;
    for (const HostPing& ping : talk.pings) all.emplace_back(ping.facts.number, ping.picture().value_or(PolarImage{}).samples);
    return all;
  };
  const auto whole = pings_of(0);
  ASSERT_FALSE(whole.empty());
  for (const std::size_t piece : {1u, 2u, 7u, 16u, 1000u}) EXPECT_EQ(pings_of(piece), whole) << piece;
}

/// Sends the device's bytes, cut or damaged at any place, to a host that has received all bytes before them.
TEST_P(Hosts, SurviveTruncatedAndDamagedMessages) {
  Talk talk(GetParam(), all_that_is_known(GetParam(), range_m), 0, model_of(GetParam()));
  talk.run(7);  // the sixth ping is the first of its second: a Surveyor sends water_stats after it
  const auto [port, last] = talk.sent.back();
  std::mt19937 random(7);
  constexpr int cuts = sonar::test::is_sanitized ? 20 : 100;  // under sanitizers hosts_fuzz damages far more
  for (int i = 0; i < 2 * cuts; ++i) {
    Talk other(GetParam(), all_that_is_known(GetParam(), range_m), 0, model_of(GetParam()));
    other.run(2);
    const std::size_t before = other.pings.size();
    Bytes bytes(last.begin(), last.begin() + static_cast<std::ptrdiff_t>(i < cuts ? random() % last.size() : last.size()));
    bool hits_length = false;  // a message with a damaged length may include all following bytes
    for (std::size_t k = 0; i >= cuts && k < 4; ++k) {
      const std::size_t at = random() % std::min<std::size_t>(bytes.size(), 64);
      hits_length = hits_length || at < 16;
      bytes[at] = static_cast<std::byte>(random());
    }
    other.carry_out(other.host->on_bytes(port, bytes, other.now));
    if (i < cuts) {
      EXPECT_EQ(other.pings.size(), before) << bytes.size() << " of " << last.size() << " bytes";
    }
    for (std::size_t k = before; k < other.pings.size(); ++k) static_cast<void>(other.pings[k].picture());
    const std::size_t before_next = other.pings.size();
    if (i % 10 != 0 || hits_length) continue;
    other.run(8);
    EXPECT_TRUE(other.pings.size() > before_next || other.error)
        << "the host neither reads the next pings nor ends with an error; input " << i;
  }
}

TEST_P(Hosts, SurviveJunk) {
  std::mt19937 random(11);
  Talk talk(GetParam(), all_that_is_known(GetParam(), range_m), 0, model_of(GetParam()));
  talk.pings.clear();
  for (int i = 0; i < 300; ++i) {
    Bytes junk(random() % 3000);
    for (std::byte& b : junk) b = static_cast<std::byte>(random());
    const std::size_t port = talk.make.ports.size() - 1;
    talk.carry_out(talk.host->on_bytes(port, junk, talk.now));
  }
  EXPECT_THAT(talk.pings, testing::IsEmpty());
}

TEST_P(Hosts, RefuseSettingsThatTheMakeDoesNotHave) {
  Wanted wanted;
  wanted.more["no-such-setting"] = "1";
  const auto host = GetParam().host(wanted);
  ASSERT_FALSE(host);
  EXPECT_EQ(host.error().kind, ErrorKind::usage);
  EXPECT_THAT(host.error().text, HasSubstr("--no-such-setting does not apply to " + std::string(GetParam().title)));
  Wanted mode;
  mode.settings.mode = 99;
  const auto far = GetParam().host(mode);
  if (far) {
    Talk talk(GetParam(), mode);  // heads are known from the greeting
    ASSERT_TRUE(talk.error);
    EXPECT_EQ(talk.error->kind, ErrorKind::usage);
  }
}

TEST_P(Hosts, PutTheSonarInStandbyOrReportThatItHasNone) {
  Wanted standby;
  standby.settings.rate_hz = 0;
  const auto host = GetParam().host(standby);
  if (!host) {
    EXPECT_EQ(host.error().kind, ErrorKind::usage);
    return;
  }
  Talk talk(GetParam(), standby, 0, model_of(GetParam()));
  talk.run(3);
  EXPECT_EQ(talk.settings.rate_hz, 0);
  EXPECT_THAT(talk.pings, testing::IsEmpty());
}

TEST_P(Hosts, RequestSlowPingsForRatesBelowTheLowestOnTheWire) {
  for (const double rate_hz : {1e-300, 1e-6}) {
    Wanted slow;
    slow.settings.rate_hz = rate_hz;
    if (!GetParam().host(slow)) continue;  // this host reports that the rate cannot be set
    Talk talk(GetParam(), slow, 0, model_of(GetParam()));
    talk.run(3);
    EXPECT_LE(talk.settings.rate_hz, 2) << "2 Hz is the lowest rate of an Oculus";
  }
}

/// A sonar that keeps settings. Another driver has left a range of 7 m; then a host opens that sets 3 m.
class KeptSettings {
 public:
  /// `held_after`: number of messages of the sonar that arrive at once; later ones arrive with talk.release().
  explicit KeptSettings(const Make& make, std::size_t held_after = SIZE_MAX) : talk(make, all_that_is_known(make, 7)) {
    talk.run(12);
    found = talk.state.settings;
    talk.pings.clear();
    talk.held_after = held_after;
    talk.open(*make.host(all_that_is_known(make, range_m)));
  }
  void leave() {
    talk.carry_out(talk.host->on_leave());
    talk.release();
    if (!talk.host->has_left()) talk.run(3);  // a Micron needs a scan line
    EXPECT_TRUE(talk.host->has_left());
  }

  Talk talk;
  std::shared_ptr<const VendorSettings> found;
};
bool keeps_settings(const Make& make) { return make.device->keeps_settings() && !sets_nothing(make); }

/// A doctor or a viewer must not change what the next driver finds.
TEST_P(Hosts, LeaveASonarThatKeepsItsSettingsAsTheyFoundIt) {
  if (!keeps_settings(GetParam())) return;
  KeptSettings sonar(GetParam());
  sonar.talk.run(30);
  ASSERT_FALSE(sonar.talk.error) << sonar.talk.error->text;
  EXPECT_FALSE(sonar.talk.pings.empty());
  EXPECT_FALSE(sonar.talk.state.settings->equals(*sonar.found)) << "the host has set nothing";
  sonar.leave();
  EXPECT_TRUE(sonar.talk.state.settings->equals(*sonar.found));
}

/// Ctrl-C may come at any moment.
TEST_P(Hosts, LeaveSettingsAsTheyFoundThemEvenIfNoAnswerHasArrivedYet) {
  if (!keeps_settings(GetParam())) return;
  std::size_t changed = 0;
  for (std::size_t held_after = 0; held_after < 8; ++held_after) {
    KeptSettings sonar(GetParam(), held_after);
    sonar.talk.run(12);
    changed += sonar.talk.state.settings->equals(*sonar.found) ? 0 : 1;
    sonar.leave();
    EXPECT_TRUE(sonar.talk.state.settings->equals(*sonar.found)) << "after " << held_after << " messages";
  }
  EXPECT_GT(changed, 3u);
}

TEST_P(Hosts, KeepLaterSettingsOfAnotherDriver) {
  if (!keeps_settings(GetParam())) return;
  KeptSettings sonar(GetParam());
  sonar.talk.run(30);
  auto ours = std::move(sonar.talk.host);
  sonar.talk.open(*GetParam().host(all_that_is_known(GetParam(), 30)));
  sonar.talk.run(30);
  const double anothers_m = sonar.talk.settings.range_m;
  ASSERT_GT(anothers_m, 8);
  sonar.talk.host = std::move(ours);
  sonar.talk.run(10);
  sonar.leave();
  EXPECT_EQ(sonar.talk.settings.range_m, anothers_m);
}

TEST_P(Hosts, RestoreTheFirstSettingsAfterALostConnection) {
  if (!keeps_settings(GetParam())) return;
  for (const std::size_t held_after : {SIZE_MAX, std::size_t{5}, std::size_t{0}}) {
    KeptSettings sonar(GetParam(), held_after);
    sonar.talk.run(12);  // not so long that the host gives up waiting for the settings
    for (int lost = 0; lost < 2; ++lost) {
      Wanted again = all_that_is_known(GetParam(), range_m);
      again.changed = sonar.talk.host->changed();
      sonar.talk.forget_held();
      sonar.talk.open(*GetParam().host(again));
      sonar.talk.run(30);
    }
    EXPECT_FALSE(sonar.talk.state.settings->equals(*sonar.found));
    sonar.leave();
    EXPECT_TRUE(sonar.talk.state.settings->equals(*sonar.found)) << held_after;
  }
}

TEST_P(Hosts, PutBackTheFirstSettingsEvenIfTheyLeaveSoonAfterALostConnection) {
  if (!keeps_settings(GetParam())) return;
  for (std::size_t held_after = 0; held_after < 8; ++held_after) {
    KeptSettings sonar(GetParam());
    sonar.talk.run(30);
    Wanted again = all_that_is_known(GetParam(), range_m);
    again.changed = sonar.talk.host->changed();
    ASSERT_FALSE(sonar.talk.state.settings->equals(*sonar.found));
    sonar.talk.held_after = held_after;
    sonar.talk.open(*GetParam().host(again));
    sonar.leave();
    EXPECT_TRUE(sonar.talk.state.settings->equals(*sonar.found)) << "after " << held_after << " messages";
  }
}

TEST_P(Hosts, KeepWhatAnotherDriverHasSetWhileTheConnectionWasLost) {
  if (!keeps_settings(GetParam())) return;
  for (std::size_t held_after = 0; held_after < 8; ++held_after) {
    KeptSettings sonar(GetParam());
    sonar.talk.run(30);
    Wanted again = all_that_is_known(GetParam(), range_m);
    again.changed = sonar.talk.host->changed();
    sonar.talk.open(*GetParam().host(all_that_is_known(GetParam(), 30)));
    sonar.talk.run(30);
    const double anothers_m = sonar.talk.settings.range_m;
    ASSERT_GT(anothers_m, 8);
    sonar.talk.held_after = held_after;
    sonar.talk.open(*GetParam().host(again));
    sonar.leave();
    EXPECT_EQ(sonar.talk.settings.range_m, anothers_m) << "after " << held_after << " messages";
  }
}

TEST_P(Hosts, SendNoSettingsWhenTheSonarIsToBeLeftAsItIs) {
  Wanted nothing;
  nothing.as_it_is = true;
  Talk talk(GetParam(), nothing, 0, model_of(GetParam()));
  const auto before = talk.state.settings;
  const PingSettings first = GetParam().device->initial_settings(talk.state).settings;
  talk.run(3);
  EXPECT_EQ(talk.settings.range_m, first.range_m);
  EXPECT_EQ(talk.settings.rate_hz, first.rate_hz);
  if (!GetParam().each_ping_requested) {  // each request for a ping names a head, which becomes the active head
    EXPECT_EQ(talk.state.settings, before);
  }
}

TEST(Makes, HostsOfMakesWithTheSamePortDetectTheSonar) {
  for (const Make& one : makes())
    for (const Make& other : makes()) {
      if (&one == &other || one.ports.front().number != other.ports.front().number) continue;
      Make mixed = one;
      mixed.host = other.host;
      Talk talk(mixed, {});
      talk.run(6);
      EXPECT_FALSE(talk.error) << talk.error->text;
      EXPECT_FALSE(talk.pings.empty());
      EXPECT_EQ(talk.host->about(), one.title);
    }
}

TEST(Makes, RefuseARateAboveThatOfTheSonar) {
  for (const char* name : {"surveyor240", "omniscan450", "ping1d", "s500", "norbit", "oculus", "aris"}) {
    const Make& make = *find_make(name);
    const auto refusal = [&make](double rate_hz) {
      Wanted wanted;
      wanted.settings.rate_hz = rate_hz;
      const auto host = make.host(wanted);
      return host ? Talk(make, wanted).error : host.error();  // a host may have to find out first which product it reaches
    };
    const double fastest_hz = static_cast<double>(make.device->models().front()->max_rate_hz);
    EXPECT_FALSE(refusal(fastest_hz)) << name;
    const auto why = refusal(1.01 * fastest_hz);
    ASSERT_TRUE(why) << name;
    EXPECT_EQ(why->kind, ErrorKind::usage);
    EXPECT_THAT(why->text, testing::MatchesRegex("the rate of " + std::string(make.title) + " is [01] to .*"));
  }
  // The heads of this make differ, so the host knows the limit only when it knows the product.
  const Make& blueview = *find_make("blueview");
  Wanted wanted;
  wanted.settings.rate_hz = 40.5;
  EXPECT_THAT(blueview.host(wanted).error().text, HasSubstr("the rate of a BlueView sonar is 0 to 40 Hz, not 40.5 Hz"));
  wanted.settings.rate_hz = 15.5;
  Talk talk(blueview, wanted, 0, 0);
  talk.run(1);
  ASSERT_TRUE(talk.error);
  EXPECT_THAT(talk.error->text, HasSubstr("P900-90 is 0 to 15 Hz, not 15.5 Hz"));
}

TEST(Makes, ReportTheGainOfTheNearestStep) {
  for (const auto& [name, expected] :
       {std::pair("ping1d", "gain 33 % (step 2 of 6), not 40 %"), std::pair("s500", "gain 38 % (step 5 of 13), not 40 %"),
        std::pair("omniscan450", "gain 43 % (step 3 of 7), not 40 %"),
        std::pair("ping360", "gain 50 % (step 1 of 2), not 40 %")}) {
    Wanted wanted;
    wanted.settings.gain_percent = 40;
    Talk talk(*find_make(name), wanted);
    talk.run(30);
    ASSERT_FALSE(talk.pings.empty()) << name;
    EXPECT_THAT(talk.pings.back().limited, testing::ElementsAre(expected)) << name;
    wanted.settings.gain_percent = 100;
    Talk exact(*find_make(name), wanted);
    exact.run(30);
    ASSERT_FALSE(exact.pings.empty()) << name;
    EXPECT_THAT(exact.pings.back().limited, testing::IsEmpty()) << name;
  }
}

/// A fan of points opens downwards if the sonar looks down.
TEST(Makes, DrawTheFanOfASonarThatLooksAheadUpwards) {
  std::map<std::string, bool> downwards;
  for (const Make& make : makes())
    for (std::size_t model = 0; model < make.device->models().size() && make.picture == PictureKind::points; ++model) {
      Talk talk(make, {}, 0, model);
      talk.run(30);
      ASSERT_FALSE(talk.pings.empty()) << make.name();
      downwards[talk.state.model->profile] = talk.pings.back().drawing().elevation_rad < 0;
    }
  EXPECT_THAT(downwards, testing::ElementsAre(std::pair("norbit-fls", false), std::pair("norbit-wbms", true),
                                              std::pair("surveyor-240", true)));
}

TEST(Makes, HaveNamesAndPortsOfTheirOwn) {
  for (const Make& one : makes()) {
    EXPECT_FALSE(one.title.empty());
    for (const Make& other : makes())
      if (&one != &other) {
        EXPECT_NE(one.name(), other.name());
        if (!one.shares_port || !other.shares_port) {
          EXPECT_NE(one.ports.front().number, other.ports.front().number);
        }
      }
    bool served = false;
    for (const Port& port : one.device->ports()) served = served || port.number == one.ports.front().number;
    EXPECT_TRUE(served) << "the device does not listen at the port of its host";
  }
}

TEST(Makes, NameTheContentOfEachAddress) {
  const std::vector<Endpoint> status_to{{{10, 0, 0, 255}, 0}};
  for (const Make& one : makes()) {
    const auto addresses = driver_addresses(*one.device, {10, 0, 0, 5}, status_to);
    EXPECT_FALSE(addresses.empty()) << one.name();
    for (const DriverAddress& address : addresses) {
      EXPECT_FALSE(address.carries.empty()) << one.name() << ' ' << address.at.port;
      EXPECT_NE(address.at.port, 0) << one.name();
      EXPECT_LE(line_of(address.protocol, "255.255.255.255:65535", address.carries, address.sonar_speaks_first).size(), 110u);
    }
  }
}

TEST(Makes, AddressLinesOfAnOlderDaemonHaveNoContent) {
  EXPECT_EQ(line_of("tcp", "127.0.0.2:52100", "", false), "tcp        127.0.0.2:52100            waits for the driver");
  EXPECT_EQ(line_of("tcp", "127.0.0.2:52100", "pings", true),
            "tcp        127.0.0.2:52100            pings; sent without a request");
}

}  // namespace
}  // namespace sonar::protocol::hosts_test
