// An emulated ARIS in virtual time: the datagrams to its receivers.
#include <gmock/gmock.h>

#include "protocol/aris/encode_frame.hpp"
#include "tests/daemon/emulator/sonar/virtual_time.hpp"

namespace sonar::aris_sonar_test {
namespace {

using namespace testing_emulator;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr ConnectionId stream = 99;

struct Talk {
  Talk() : time(yaml_of("  - name: front\n    profile: aris-3000\n    bind_ip: 127.0.0.2\n")) {
    time.sonar("front").open_stream(stream, *time.sonar("front").vendor().port(protocol::Port::Kind::udp_stream), time.now);
    connect();
  }
  void connect() {
    client = time.connect("front");
    aris::Command command;
    command.type = aris::CommandType::set_receiver;
    command.receiver = aris::Receiver{56444, ""};
    time.send(client, aris::framed(command));
    command = {};
    command.type = aris::CommandType::set_acoustics;
    command.acoustics = {1, 10, 800, 1360, 4920, 4, 6, 9, true, aris::Frequency::high, true, 12};
    time.send(client, aris::framed(command));
  }
  /// Returns the frames of this time, as datagrams.
  std::vector<std::vector<protocol::Bytes>> frames(milliseconds length) {
    std::vector<std::vector<protocol::Bytes>> all;
    for (const Time end = time.now + length; time.now < end;) {
      time.run(milliseconds(20));
      while (const Outbox::Message message = time.sonar("front").next_message(stream, time.now)) {
        all.push_back(*message.datagrams);
        time.sonar("front").on_written(stream, message, time.now);
      }
    }
    return all;
  }
  /// Returns the indexes of the frames.
  std::vector<std::int32_t> run(milliseconds length) {
    std::vector<std::int32_t> indexes;
    for (const auto& frame : frames(length)) indexes.push_back(part_of(frame.front()).frame_index);
    return indexes;
  }
  static aris::FramePart part_of(const protocol::Bytes& datagram) {
    aris::FramePart part;
    EXPECT_TRUE(aris::protobuf::read(datagram, part));
    return part;
  }
  std::vector<aris::Availability> beacons() {
    std::vector<aris::Availability> all;
    for (const protocol::Bytes& datagram : time.sonar("front").beacons(time.now))
      EXPECT_TRUE(aris::protobuf::read(datagram, all.emplace_back()));
    return all;
  }
  void add_fault(const std::string& what, std::map<std::string, std::string> with) {
    FaultRecord record;
    record.what = what;
    record.with = std::move(with);
    time.add_fault("front", record);
  }

  VirtualTime time;
  ConnectionId client = 0;
};

TEST(ArisInVirtualTime, FramesAreCountedFromOneAfterARestart) {
  Talk talk;
  EXPECT_THAT(talk.run(milliseconds(350)), ElementsAre(1, 2, 3, 4));
  talk.add_fault("L10", {{"boot-s", "1"}});
  talk.run(seconds(5));
  talk.connect();
  EXPECT_THAT(talk.run(milliseconds(650)), ElementsAre(1, 2, 3, 4, 5, 6, 7));
}

TEST(ArisInVirtualTime, FramesThatAFaultDropsAreCounted) {
  Talk talk;
  talk.add_fault("F16", {});
  const std::size_t frames = talk.run(seconds(3)).size();
  const DeviceFigures f = talk.time.sonar("front").figures();
  EXPECT_LT(frames, f.offered);
  EXPECT_EQ(f.offered, frames + f.dropped);
}

TEST(ArisInVirtualTime, FramesOfTheReceiverCountForTheController) {
  Talk talk;
  std::size_t bytes = 0;
  const auto frames = talk.frames(milliseconds(350));
  for (const auto& frame : frames)
    for (const protocol::Bytes& datagram : frame) bytes += datagram.size();
  const Connection* const controller = talk.time.sonar("front").connections().find(talk.client);
  ASSERT_NE(controller, nullptr);
  EXPECT_EQ(controller->pings_written(), frames.size());
  EXPECT_EQ(controller->streamed_bytes, bytes);
  EXPECT_EQ(talk.time.sonar("front").figures().served, frames.size()) << "no frame is counted twice";
}

TEST(ArisInVirtualTime, AFrameThatWaitsIsNotSentToTheNextController) {
  Talk talk;
  talk.time.run(milliseconds(350));
  talk.time.close(talk.client);
  talk.client = talk.time.connect("front");
  EXPECT_THAT(talk.run(milliseconds(500)), IsEmpty());
}

TEST(ArisFaults, FrameNumbersJumpRestartOrStayTheSame) {
  Talk talk;
  talk.run(milliseconds(350));
  talk.time.close(talk.client);
  talk.connect();  // frame numbers begin again, numbers of pings do not
  EXPECT_THAT(talk.run(milliseconds(350)), ElementsAre(1, 2, 3, 4));
  const auto during = [&](const std::string& what, std::map<std::string, std::string> with) {
    talk.add_fault(what, std::move(with));
    const auto indexes = talk.run(milliseconds(300));
    talk.time.end_faults("front");
    return indexes;
  };
  EXPECT_THAT(during("D09", {{"by", "-3"}}), ElementsAre(2, 3, 4));
  EXPECT_THAT(during("D08", {}), ElementsAre(1, 2, 3));
  EXPECT_THAT(during("D10", {}), ElementsAre(11, 11, 11));
  EXPECT_THAT(during("D09", {}), ElementsAre(1014, 1015, 1016));
}

TEST(ArisFaults, ATroubleUsesOnlyKindsWithEffect) {
  Talk talk;
  const auto why = [&](const std::string& what) {
    FaultRecord record;
    record.what = what;
    return talk.time.sonar("front").why_no_faults(*check_fault(record, true)).value_or(FaultRefusal{}).text;
  };
  EXPECT_EQ(why("electrical-noise"), "");
  EXPECT_EQ(
      why("thin-tether"),
      "none of the kinds of thin-tether has an effect: fault thin-tether.1: L13 has no effect on the sonar front (sends pings "
      "by datagrams alone)");
  EXPECT_EQ(why("D24"), "fault D24: D24 has no effect on the sonar front (has no standby)");
  talk.add_fault("electrical-noise", {});
  EXPECT_EQ(talk.time.sonar("front").faults().list().size(), 2u) << "two of the trouble's three kinds have an effect";
}

TEST(ArisFaults, APartIsLostOrLate) {
  Talk talk;
  const auto whole = talk.frames(milliseconds(350)).back();
  talk.add_fault("G01", {{"which", "first"}});
  auto frames = talk.frames(milliseconds(100));
  ASSERT_EQ(frames.at(0).size(), whole.size() - 1);
  EXPECT_FALSE(Talk::part_of(frames[0].front()).header);
  talk.add_fault("G08", {});
  frames = talk.frames(milliseconds(200));
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].size(), whole.size() - 1);
  ASSERT_EQ(frames[1].size(), whole.size() + 1);
  EXPECT_EQ(Talk::part_of(frames[1][1]).frame_index, Talk::part_of(frames[1][0]).frame_index - 1);
}

TEST(ArisFaults, EveryPartStatesAnotherSize) {
  Talk talk;
  talk.add_fault("F07", {{"add", "-100"}});
  const auto frame = talk.frames(milliseconds(150)).at(0);
  for (const protocol::Bytes& datagram : frame) EXPECT_EQ(Talk::part_of(datagram).total_size, 128 * 800 - 100);
}

TEST(ArisFaults, TheFocusMotorIsStalled) {
  Talk talk;
  talk.add_fault("D32", {});
  const auto frame = talk.frames(milliseconds(150)).at(0);
  EXPECT_EQ(Talk::part_of(frame.front()).header->data()[560], std::byte{1});
}

TEST(ArisFaults, BeaconsStateBusyAnotherSonarOrTooHot) {
  Talk talk;
  talk.time.close(talk.client);
  EXPECT_EQ(talk.beacons().at(0).busy, 0u);
  talk.add_fault("U09", {});
  EXPECT_EQ(talk.beacons().at(0).busy, 1u);
  talk.time.end_faults("front");
  talk.add_fault("U07", {});
  auto beacons = talk.beacons();
  ASSERT_EQ(beacons.size(), 2u);
  EXPECT_EQ(beacons[1].serial, beacons[0].serial + 1);
  talk.time.end_faults("front");
  talk.connect();
  talk.add_fault("D16", {});
  EXPECT_GT(talk.beacons().at(0).cpu_c, talk.beacons().at(0).hot_limit_c);
  EXPECT_FALSE(talk.beacons().at(0).power_down_reason);
  talk.time.end_faults("front");
  talk.add_fault("D17", {});
  EXPECT_EQ(talk.beacons().at(0).power_down_reason, 0u);
  talk.run(milliseconds(200));
  EXPECT_THAT(talk.run(seconds(3)), IsEmpty()) << "powered down";
}

TEST(ArisFaults, AKeepAliveIsAnsweredByAReset) {
  Talk talk;
  aris::Command ping;
  ping.type = aris::CommandType::ping;
  talk.add_fault("M09", {{"how", "reset"}});
  talk.time.send(talk.client, aris::framed(ping));
  EXPECT_FALSE(talk.time.clients[talk.client].reset) << "a keep-alive changes no settings";
  talk.time.end_faults("front");
  talk.add_fault("M09", {{"how", "reset"}, {"command", "any"}});
  talk.time.send(talk.client, aris::framed(ping));
  EXPECT_TRUE(talk.time.clients[talk.client].reset);
}

}  // namespace
}  // namespace sonar::aris_sonar_test
