// An emulated ARIS in virtual time: what its receivers are sent.
#include <gmock/gmock.h>

#include "protocol/aris/encode_frame.hpp"
#include "tests/daemon/emulator/sonar/virtual_time.hpp"

namespace sonar {
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
  /// Indexes of the frames of this time.
  std::vector<std::int32_t> run(milliseconds length) {
    std::vector<std::int32_t> indexes;
    for (const Time end = time.now + length; time.now < end;) {
      time.run(milliseconds(20));
      while (const Outbox::Message message = time.sonar("front").next_message(stream, time.now)) {
        aris::FramePart part;
        aris::protobuf::read(message.datagrams->front(), part);
        indexes.push_back(part.frame_index);
        time.sonar("front").on_written(stream, message, time.now);
      }
    }
    return indexes;
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

TEST(ArisInVirtualTime, AFrameThatWaitsIsNotSentToTheNextController) {
  Talk talk;
  talk.time.run(milliseconds(350));
  talk.time.close(talk.client);
  talk.client = talk.time.connect("front");
  EXPECT_THAT(talk.run(milliseconds(500)), IsEmpty());
}

}  // namespace
}  // namespace sonar
