// Tests the packets of an emulated Norbit, with offsets typed by hand, and its commands and refusals, without a socket.
#include <gmock/gmock.h>

#include <cmath>
#include <cstring>

#include "core/image/draw_picture.hpp"
#include "protocol/norbit/norbit.hpp"
#include "protocol/recorded/byte_source.hpp"
#include "tests/protocol/norbit/norbit_testing.hpp"

namespace sonar::norbit {
namespace {

using namespace tests;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

template <class T>
T at(BytesView bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

/// Packets of a ping with an echo in row 100 of beam 10 of 256, which is to port.
struct Packets : testing::Test {
  Settings settings{.power = 1, .stop_m = 12};
  protocol::DeviceState state = device();
  Ping ping = ping_with(settings, state, 100, 10);
  Bytes bathymetry = encode_bathymetry(ping, state), column = encode_column(ping, state);
};

TEST_F(Packets, HaveTheHeaderOfThePublicDescription) {
  for (const Bytes& packet : {bathymetry, column}) {
    EXPECT_EQ(at<std::uint32_t>(packet, 0), 0xDEADBEEF);
    EXPECT_EQ(at<std::uint32_t>(packet, 8), packet.size());
    EXPECT_EQ(at<std::uint32_t>(packet, 12), 4u);
    EXPECT_EQ(at<std::uint32_t>(packet, 20), recording::crc32(BytesView(packet).subspan(24)));
    EXPECT_EQ(at<float>(packet, 24), 1500);
    EXPECT_NEAR(at<double>(packet, 40), 1.7e9 + 0.25, 1e-6);
  }
  EXPECT_EQ(at<std::uint32_t>(bathymetry, 4), 1u);
  EXPECT_EQ(at<std::uint32_t>(column, 4), 2u);
  EXPECT_EQ(bathymetry.size(), 112u + 20 * 256);
  EXPECT_EQ(at<std::uint32_t>(bathymetry, 32), 256u);
  EXPECT_EQ(at<std::uint32_t>(bathymetry, 36), 7u);
  EXPECT_EQ(at<float>(bathymetry, 28), 78125);
  EXPECT_EQ(at<std::uint32_t>(column, 108), 7u);
  EXPECT_EQ(at<float>(column, 72), 400) << "kHz";
  EXPECT_EQ(at<float>(bathymetry, 80), 400e3f) << "Hz";
}

TEST_F(Packets, AnEchoToPortHasANegativeAngleAndItsRange) {
  const double range_m = ping.request.settings.range_of_row(100);
  int found = 0;
  for (std::size_t i = 0; i < 256; ++i) {
    const std::size_t beam = 112 + 20 * i;
    if (at<std::uint32_t>(bathymetry, beam) == 0) {
      EXPECT_EQ(bathymetry[beam + 18], std::byte{0});
      continue;
    }
    ++found;
    EXPECT_EQ(i, 10u);
    EXPECT_NEAR(at<float>(bathymetry, beam + 4), -ping.beam_azimuth_rad[10], 0.002);
    EXPECT_NEAR(at<std::uint32_t>(bathymetry, beam) * 1500 / (2 * 78125.0), range_m, 0.01);
    EXPECT_EQ(bathymetry[beam + 18], std::byte{3});
    EXPECT_NEAR(at<float>(bathymetry, beam + 12), std::pow(10, (-20.0 - 20) / 20), 1e-4)
        << "the intensity is without the gain of 20 dB";
  }
  EXPECT_EQ(found, 1);
}

TEST_F(Packets, TheWaterColumnHasTheEchoAtTheSamePlace) {
  const auto beams = at<std::uint32_t>(column, 32), rows = at<std::uint32_t>(column, 36);
  EXPECT_EQ(beams, 128u);
  EXPECT_NEAR(rows, 256, 64);
  ASSERT_EQ(column.size(), 192 + beams * (2 * rows + 4));
  EXPECT_EQ(at<std::uint32_t>(column, 48), 3u) << "int16";
  std::size_t brightest = 0;
  for (std::size_t i = 0; i < beams * rows; ++i)
    if (at<std::int16_t>(column, 192 + 2 * i) > at<std::int16_t>(column, 192 + 2 * brightest)) brightest = i;
  const std::size_t directions = 192 + 2 * beams * rows;
  const double coarse_m = 1500 / (2 * static_cast<double>(at<float>(column, 28)));
  EXPECT_NEAR((at<std::int32_t>(column, 52) + static_cast<double>(brightest / beams)) * coarse_m,
              ping.request.settings.range_of_row(100), coarse_m);
  EXPECT_NEAR(at<float>(column, directions + 4 * (brightest % beams)), -ping.beam_azimuth_rad[10], 0.02);
  EXPECT_LT(at<float>(column, directions), at<float>(column, directions + 4));
  EXPECT_NEAR(std::fmod(78125, static_cast<double>(at<float>(column, 28))) / 78125, 0, 1e-3)
      << "the sample rate of the column is a whole fraction of 78125 Hz";
}

TEST_F(Packets, TruncatedAndDamagedPacketsAreRefused) {
  EXPECT_TRUE(read_bathymetry(bathymetry));
  EXPECT_TRUE(read_column(column));
  EXPECT_FALSE(read_column(bathymetry));
  for (const Bytes& packet : {bathymetry, column}) {
    for (std::size_t size = 0; size < packet.size(); size += size < 300 ? 1 : 97) {
      EXPECT_FALSE(read_bathymetry(BytesView(packet).first(size)));
      EXPECT_FALSE(read_column(BytesView(packet).first(size)));
    }
    for (std::size_t i = 24; i < packet.size(); i += 101) {
      Bytes damaged = packet;
      damaged[i] ^= std::byte{1};
      EXPECT_FALSE(read_bathymetry(damaged)) << i;
      EXPECT_FALSE(read_column(damaged)) << i;
      reseal(packet, damaged);
      EXPECT_NE(at<std::uint32_t>(damaged, 20), at<std::uint32_t>(packet, 20));
    }
  }
}

TEST_F(Packets, FieldsForFaultsAreFound) {
  Bytes both = bathymetry;
  both.insert(both.end(), column.begin(), column.end());
  EXPECT_EQ(locate(means::ping_id, bathymetry)->offset, 36u);
  EXPECT_EQ(locate(means::ping_id, column)->offset, 108u);
  EXPECT_EQ(locate(means::rows, both)->offset, bathymetry.size() + 36);
  EXPECT_EQ(locate(protocol::Region::image, both)->first, bathymetry.size() + 192);
  EXPECT_EQ(locate(protocol::Region::bearings, column)->second, 4u * 128);
  EXPECT_EQ(locate(protocol::Region::bearings, bathymetry), std::nullopt);
  Bytes changed = both;
  changed[40] ^= std::byte{1};
  changed[bathymetry.size() + 40] ^= std::byte{1};
  reseal(both, changed);
  EXPECT_TRUE(read_bathymetry(BytesView(changed).first(bathymetry.size())));
  EXPECT_TRUE(read_column(BytesView(changed).subspan(bathymetry.size())));
}

TEST_F(Packets, TheAnalogGainRisesByTheSlopeOfSetVga) {
  const double row_m = 1500 / (2 * static_cast<double>(at<float>(column, 28)));
  const auto rise_db = static_cast<double>(at<float>(column, 136) - at<float>(column, 128));
  EXPECT_NEAR(rise_db / (2 * at<std::int32_t>(column, 132) * row_m), 50.0 / 100, 0.005) << "50 dB per 100 m of two-way range";
}

TEST_F(Packets, PixelsBelowZeroAreDark) {
  const std::size_t pixels = 2 * at<std::uint32_t>(column, 32) * at<std::uint32_t>(column, 36);
  Bytes dark = column;
  for (std::size_t i = 192; i < 192 + pixels; ++i) dark[i] = std::byte{0xFF};  // -1
  reseal(column, dark);
  const auto host = *make_host({.as_it_is = true, .settings = {}});
  host->on_bytes(0, bathymetry, at_s(0));
  const protocol::HostActions shown = host->on_bytes(1, dark, at_s(0));
  ASSERT_EQ(shown.size(), 1u);
  const auto picture = std::get<protocol::HostPing>(shown[0]).picture();
  ASSERT_TRUE(picture);
  EXPECT_EQ(std::ranges::max(picture->samples), 0);
}

/// A host that gets packets from ports: 0 is the bathymetry, 1 is the water column.
struct Hosts : Packets {
  void receive(std::size_t port, std::uint32_t number, double at) {
    const Bytes& like = port == 0 ? bathymetry : column;
    Bytes packet = like;
    const auto field = locate(means::ping_id, packet);
    for (unsigned b = 0; b < 4; ++b) packet[field->offset + b] = static_cast<std::byte>(number >> (8 * b));
    reseal(like, packet);
    note(host->on_bytes(port, packet, at_s(at)));
  }
  void note(const protocol::HostActions& actions) {
    for (const auto& action : actions) {
      if (const auto* notice = std::get_if<protocol::Notice>(&action)) notices_text += notice->text;
      const auto* const seen = std::get_if<protocol::HostPing>(&action);
      if (seen == nullptr) continue;
      EXPECT_THAT(seen->errors, IsEmpty());
      const SonarPicture drawn = seen->drawing();
      shown += std::to_string(seen->facts.number) + (drawn.points.empty() ? "" : "p") + (seen->picture() ? "c" : "") + " ";
      EXPECT_TRUE(PicturePainter({100, *find_colour_map("gray"), false}).draw(drawn));
    }
  }
  std::string take() { return std::exchange(shown, {}); }

  std::unique_ptr<protocol::Host> host = *make_host({.as_it_is = true, .settings = {}});
  std::string shown, notices_text;  // numbers of shown pings, with "p" for points and "c" for a water column; notices
};

TEST_F(Hosts, ShowCompletePings) {
  for (std::uint32_t number = 1; number <= 9; ++number) receive(0, number, 0.1 * number);
  EXPECT_EQ(take(), "") << "the host waits for the other connection";
  receive(1, 1, 1);
  EXPECT_EQ(take(), "1pc ");
  receive(1, 2, 1.8);
  receive(1, 3, 2.6);
  EXPECT_EQ(take(), "2pc 3pc ");
  receive(1, 10, 2.7);
  EXPECT_EQ(host->next_tick(), at_s(4.7)) << "only ping 10 waits: its water column shows that those of 4 to 9 were dropped";
  receive(0, 10, 2.8);
  EXPECT_EQ(take(), "10pc ");
  EXPECT_EQ(host->counts()->missing_pings, 6u);
}

TEST_F(Hosts, KeepTheOrderOfPings) {
  for (const std::uint32_t number : {1u, 2u, 3u, 4u}) receive(1, number, 0.1);
  receive(0, 1, 0.2);
  receive(0, 4, 0.2);
  EXPECT_EQ(take(), "1pc 4pc ");
  receive(0, 5, 0.3);
  receive(0, 7, 0.3);
  receive(1, 5, 0.4);
  receive(1, 6, 0.4);
  receive(1, 7, 0.4);
  EXPECT_EQ(take(), "5pc 7pc ");
}

TEST_F(Hosts, WaitWhileBytesOfAPacketCome) {
  receive(0, 7, 0);
  const std::size_t part = column.size() / 8;
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(take(), "");
    const std::size_t size = i < 7 ? part : column.size() - 7 * part;
    note(host->on_bytes(1, BytesView(column).subspan(i * part, size), at_s(1.5 * static_cast<double>(i))));
    note(host->on_tick(at_s(1.5 * static_cast<double>(i))));
  }
  EXPECT_EQ(take(), "7pc ");
}

TEST_F(Hosts, ShowPingsOfOnePortIfTheOtherIsSilent) {
  receive(0, 1, 0);
  receive(1, 1, 0);
  take();
  receive(0, 2, 10);
  ASSERT_EQ(host->next_tick(), at_s(12));
  note(host->on_tick(at_s(11.99)));
  EXPECT_EQ(take(), "");
  note(host->on_tick(at_s(12)));
  EXPECT_EQ(take(), "2p ");
  EXPECT_EQ(host->next_tick(), std::nullopt);
  receive(1, 2, 13);
  EXPECT_EQ(take(), "") << "a ping is not shown twice";
  EXPECT_EQ(notices_text, "the water column of ping 2 came after the ping was shown");
  receive(0, 3, 14);
  receive(1, 3, 14);
  EXPECT_EQ(take(), "3pc ");
}

TEST_F(Hosts, ShowPingsOfOnePortAtOnceWhenTheOtherHasSentNothing) {
  receive(2, 1, 1);  // a recording stores the packets of all ports in one stream
  receive(2, 2, 2);
  note(host->on_tick(at_s(2)));
  EXPECT_EQ(take(), "");
  receive(2, 3, 3);
  note(host->on_tick(at_s(3)));
  EXPECT_EQ(take(), "1c 2c 3c ");
  receive(2, 4, 4);
  note(host->on_tick(at_s(4)));
  EXPECT_EQ(take(), "4c ");
}

TEST_F(Hosts, WaitForBothPortsAfterAPause) {
  receive(0, 1, 0);
  receive(1, 1, 0);
  receive(0, 2, 0.1);
  take();
  receive(0, 3, 60);  // one port is read before the other
  EXPECT_EQ(take(), "");
  receive(1, 2, 60);
  receive(1, 3, 60);
  note(host->on_tick(at_s(60)));
  EXPECT_EQ(take(), "2pc 3pc ");
}

TEST_F(Hosts, LimitWaitingMessages) {
  for (std::uint32_t number = 1; number <= 1100; ++number) receive(0, number, 0.001 * number);
  EXPECT_THAT(take(), StartsWith("1p 2p ")) << "the oldest pings are shown";
}

TEST(NorbitCommands, AreAnsweredWithTheValuesInUse) {
  Talk talk;
  talk.tick(0);
  EXPECT_EQ(talk.take(), "Sonar is ready to accept commands\r\n");
  talk.say("set_range .5 30\r\nset_range\n");
  EXPECT_EQ(talk.take(), "set_range 0.5 30 # m\r\nset_range 0.5 30 # m\r\n");
  EXPECT_EQ(talk.settings.rate_hz, 0) << "without power, the sonar does not ping";
  talk.say("set_power 1\r\n");
  EXPECT_THAT(talk.take(), StartsWith("set_power 1 #"));
  EXPECT_NEAR(talk.settings.rate_hz, 1 / (2 * 30 / 1500.0 + 0.005), 0.2);
  EXPECT_NEAR(talk.settings.range_m, 30, 0.1);
  talk.say("set_rate 5\nset_gain 30\nset_resolution 512 256\nsound_velocity 1480\n");
  EXPECT_EQ(talk.settings.rate_hz, 5);
  EXPECT_EQ(talk.settings.gain_db, 30);
  EXPECT_EQ(talk.settings.device_sound_speed_mps, 1480);
  EXPECT_EQ(talk.held().beams, 256);
  talk.take();
  talk.say("serial\nset_time_source 1\nset_mode 5\n");
  EXPECT_EQ(talk.take(), "serial 7001\r\nset_time_source 1 # fixed\r\nset_mode 1 # fixed\r\n");
  talk.say("set_vga 50\nset_tp_rate 2\nset_mf_decimation 1\nset_snippet_rate 1\n");
  EXPECT_EQ(talk.take(),
            "set_vga 50 # fixed\r\nset_tp_rate -1 # fixed\r\nset_mf_decimation 1 # fixed\r\nset_snippet_rate 0 # fixed\r\n");
  talk.say("set_default\nexit\n");
  EXPECT_EQ(talk.held(), Settings{});
  EXPECT_TRUE(talk.closed);
}

TEST(NorbitCommands, ACommandWithoutAnEndOfLineEndsAfterSilence) {
  Talk talk;
  talk.tick(0);
  talk.take();
  talk.say("set_ra", 1);
  talk.say("nge 1 20", 1.01);
  EXPECT_EQ(talk.take(), "");
  talk.tick(1.029);
  EXPECT_EQ(talk.take(), "");
  EXPECT_EQ(talk.dialogue->next_tick(), at_s(1.03));
  talk.tick(1.03);
  EXPECT_EQ(talk.take(), "set_range 1 20 # m\r\n");
  EXPECT_EQ(talk.dialogue->next_tick(), Time::max());
  talk.state.simulated_time = true;
  talk.say("set_power 1", 2);
  EXPECT_THAT(talk.take(), StartsWith("set_power 1")) << "in simulated time, such a command ends at once";
}

TEST(NorbitCommands, TheShortestRangeIsAMetreWhereverItBegins) {
  for (int cm = 0; cm < 1000; ++cm) {
    EXPECT_EQ(complaint({.start_m = cm / 100.0, .stop_m = (cm + 100) / 100.0}), "") << cm;
    EXPECT_NE(complaint({.start_m = cm / 100.0, .stop_m = (cm + 99) / 100.0}), "") << cm;
  }
}

TEST(NorbitCommands, ValuesOutsideTheLimitsChangeNothing) {
  Talk talk;
  talk.tick(0);
  talk.take();
  for (const char* wrong : {"set_range 5 5", "set_range -1 20", "set_range 0 700", "set_range 5", "set_range a b",
                            "set_range nan 5", "set_rate 0", "set_rate 61", "set_gain 41", "set_resolution 256 100",
                            "set_resolution 1e300 128", "sound_velocity 100", "set_power 1 2", "set_power 2", "set_power 0.5",
                            "set_power -0.5", "set_power 1e300", "set_resolution 256.5 128", "set_resolution 256 128.5"}) {
    talk.say(std::string(wrong) + "\n");
    EXPECT_THAT(talk.take(), HasSubstr("unchanged: ")) << wrong;
  }
  EXPECT_EQ(talk.held(), Settings{});
  talk.say("no_such 1\n\x01\xff\n");
  EXPECT_EQ(talk.take(), "no_such # unknown command\r\n\\x01\\xff # unknown command\r\n");
  talk.say(std::string(100000, 'x') + "\n");
  EXPECT_LT(talk.take().size(), 100u);
  std::string many;
  for (int i = 0; i < 10000; ++i) many += "x\n";
  talk.notices = 0;
  talk.say(many);
  EXPECT_EQ(talk.notices, 32 + 1) << "32 notices, and one that the rest is ignored";
}

TEST(Norbit, EachPortHasItsOwnPackets) {
  const protocol::DeviceState state = device();
  const Ping ping = ping_with({.power = 1, .stop_m = 5}, state, 50, 10);
  const auto parts_at = [&](std::uint16_t number) {
    const auto port = std::ranges::find(vendor().ports(), number, &protocol::Port::number);
    return vendor().datagrams(*port, ping, state);
  };
  ASSERT_EQ(parts_at(bathymetry_port).size(), 1u);
  EXPECT_TRUE(read_bathymetry(parts_at(bathymetry_port)[0]));
  ASSERT_EQ(parts_at(column_port).size(), 1u);
  EXPECT_TRUE(read_column(parts_at(column_port)[0]));
  EXPECT_TRUE(parts_at(command_port).empty());
  EXPECT_EQ(vendor().frame(ping, state), nullptr) << "a ping has only parts, one per port";
  EXPECT_TRUE(Talk(command_port).dialogue->on_ping(nullptr, 1, at_s(0)).prefixes.empty());
  EXPECT_EQ(Talk(bathymetry_port).dialogue->on_ping(nullptr, 1, at_s(0)).prefixes.size(), 1u);
}

TEST(Norbit, TheBottomIsDetectedOnce) {
  const protocol::DeviceState state = device();
  Ping ping = ping_with({.power = 1, .stop_m = 5}, state, 50, 10);
  const auto port = std::ranges::find(vendor().ports(), bathymetry_port, &protocol::Port::number);
  const auto bottom = [&] {
    std::vector<std::uint32_t> samples;
    const auto bathymetry = read_bathymetry(vendor().datagrams(*port, ping, state).at(0));
    for (const Beam& beam : bathymetry->beams) samples.push_back(beam.sample);
    return samples;
  };
  const auto detected_now = bottom();
  look_at(ping);
  std::fill(ping.samples.begin(), ping.samples.end(), std::byte{0});
  EXPECT_EQ(bottom(), detected_now) << "look_at() has stored the bottom before the samples were lost";
  look_at(ping);
  EXPECT_NE(bottom(), detected_now);
}

TEST(Norbit, GridsFitTheirRange) {
  for (const double stop_m : {1.0, 2.0, 5.0, 50.0, 150.0, 600.0})
    for (const double start_m : {0.0, 0.5, stop_m - 1})
      for (const int samples : {64, 256, 2048}) {
        if (start_m < 0 || stop_m - start_m < 1) continue;
        const Grid grid = grid_of({.start_m = start_m, .stop_m = stop_m, .samples = samples}, 1500);
        SCOPED_TRACE(testing::Message() << start_m << " to " << stop_m << " m, " << samples);
        EXPECT_LE(grid.rows, 1100);
        EXPECT_EQ(grid.first % (grid.step * grid.thin), 0);
        EXPECT_GT(grid.first, 0);
        EXPECT_LE(grid.column_rows(), 2 * samples);
        EXPECT_NEAR((grid.first + grid.rows * grid.step) * grid.sample_m, stop_m, 1.01 * grid.step * grid.sample_m);
      }
}

}  // namespace
}  // namespace sonar::norbit
