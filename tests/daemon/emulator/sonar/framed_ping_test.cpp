// The bytes of a ping for each port, for a make with several TCP ports and for a recording.
#include <gmock/gmock.h>

#include "daemon/emulator/sonar/delivery.hpp"
#include "tests/daemon/server/sonars/made_up_vendor.hpp"
#include "tests/protocol/delegating_vendor.hpp"

namespace sonar {
namespace {

using protocol::Bytes;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

Bytes bytes_of(char c) { return Bytes(3, static_cast<std::byte>(c)); }

/// A make with two TCP ports. If `frames` is set, frame() returns the bytes of the first.
class TwoPorts final : public protocol::DelegatingVendor {
 public:
  TwoPorts() : DelegatingVendor(testing_daemon::made_up_vendor()) {}
  std::span<const protocol::Port> ports() const override { return table; }
  std::shared_ptr<const Bytes> frame(const Ping&, const protocol::DeviceState&) const override {
    ++framed;
    return frames ? std::make_shared<const Bytes>(bytes_of('a')) : nullptr;
  }
  std::vector<Bytes> datagrams(const protocol::Port& port, const Ping&, const protocol::DeviceState&) const override {
    asked.push_back(port.number);
    return {bytes_of(port.number == 1 ? 'a' : 'b')};
  }
  std::array<protocol::Port, 2> table{
      {{.kind = protocol::Port::Kind::tcp_stream, .number = 1}, {.kind = protocol::Port::Kind::tcp_stream, .number = 2}}};
  bool frames = true;
  mutable int framed = 0;
  mutable std::vector<int> asked;
};

struct FramedPingAtTwoPorts : ::testing::Test {
  TwoPorts vendor;
  protocol::DeviceState state;
  Ping ping;
  const protocol::Port &first = vendor.table[0], &second = vendor.table[1];
};

TEST_F(FramedPingAtTwoPorts, TheFrameIsThatOfTheFirstPort) {
  FramedPing framed(vendor, state, ping);
  EXPECT_EQ(*framed.bytes_at(first), bytes_of('a'));
  EXPECT_EQ(framed.bytes_at(first), framed.bytes()) << "the bytes are shared, not copied";
  EXPECT_THAT(vendor.asked, IsEmpty()) << "no client is at the second port";
  EXPECT_EQ(*framed.bytes_at(second), bytes_of('b'));
  EXPECT_EQ(*framed.bytes_at(second), bytes_of('b'));
  EXPECT_EQ(vendor.framed, 1);
  EXPECT_THAT(vendor.asked, ElementsAre(2));
}

TEST_F(FramedPingAtTwoPorts, WithoutAFrameThePartsMakeUpTheWhole) {
  vendor.frames = false;
  FramedPing framed(vendor, state, ping);
  EXPECT_EQ(framed.bytes()->size(), 6u);
  EXPECT_EQ(*framed.bytes_at(first), bytes_of('a'));
  EXPECT_EQ(*framed.bytes_at(second), bytes_of('b'));
  EXPECT_THAT(vendor.asked, ElementsAre(1, 2));
}

TEST_F(FramedPingAtTwoPorts, EachPortHasItsPartsOfARecording) {
  const PartsByPort recorded{{2, bytes_of('y')}, {1, bytes_of('x')}};
  FramedPing framed(vendor, state, ping, &recorded);
  EXPECT_EQ(*framed.bytes_at(first), bytes_of('x'));
  EXPECT_EQ(*framed.bytes_at(second), bytes_of('y'));
  const PartsByPort one{{2, bytes_of('z')}};
  FramedPing part(vendor, state, ping, &one);
  EXPECT_EQ(part.bytes_at(first), nullptr);
  EXPECT_EQ(*part.bytes_at(second), bytes_of('z'));
  EXPECT_EQ(vendor.framed, 0) << "no frame is made of the ping";
  EXPECT_THAT(vendor.asked, IsEmpty());
}

TEST(FramedPing, ARecordedPingIsFramedAtAnyPort) {
  const protocol::Vendor& vendor = testing_daemon::made_up_vendor();
  const protocol::DeviceState state;
  const Ping ping;
  const PartsByPort recorded{{0, bytes_of('x')}}, none;
  FramedPing framed(vendor, state, ping, &recorded);
  for (const protocol::Port& port : vendor.ports()) EXPECT_THAT(*framed.parts(port), ElementsAre(bytes_of('x')));
  EXPECT_EQ(*framed.bytes(), bytes_of('x'));
  FramedPing nothing(vendor, state, ping, &none);
  EXPECT_EQ(nothing.bytes(), nullptr) << "the recording is over";
  EXPECT_THAT(*nothing.parts(vendor.ports().front()), IsEmpty());
}

}  // namespace
}  // namespace sonar
