// Tests frames of the ping protocol: published bytes, and arbitrary bytes that are split anywhere.
#include <gmock/gmock.h>

#include <random>

#include "tests/is_sanitized.hpp"
#include "tests/protocol/ping/ping_testing.hpp"

namespace sonar::ping {
namespace {

using namespace tests;

TEST(PingFrames, HaveThePublishedBytes) {
  EXPECT_EQ(general(Id::protocol_version), hex("42 52 02 00 06 00 00 00 05 00 A1 00"));
  EXPECT_EQ(framed_message(Id::protocol_version, 0, ProtocolVersion{1, 2, 3, 0}),
            hex("42 52 04 00 05 00 00 00 01 02 03 00 A3 00"));
}

TEST(PingFrames, MessagesHaveThePublishedSizes) {
  EXPECT_EQ(wire::wire_size<Transducer>(), 14u);
  EXPECT_EQ(wire::wire_size<DeviceData>(), 14u);
  EXPECT_EQ(wire::wire_size<AutoTransmit>(), 16u);
  EXPECT_EQ(wire::wire_size<AutoDeviceData>(), 20u);
  EXPECT_EQ(wire::wire_size<PingParameters>(), 36u);
  EXPECT_EQ(wire::wire_size<AtofPointData>(), 40u);
  EXPECT_EQ(wire::wire_size<AtofPoint>(), 16u);
  EXPECT_EQ(wire::wire_size<YzPointData>(), 100u);
  EXPECT_EQ(wire::wire_size<AttitudeReport>(), 36u);
}

TEST(PingFrames, AFrameAfterAWrongOneIsFound) {
  Bytes wrong = general(Id::protocol_version);
  wrong.back() = std::byte{0x55};
  Framer framer;
  framer.append(hex("00 FF 42"));
  framer.append(wrong);
  framer.append(general(Id::device_information));
  const auto first = framer.next(), second = framer.next();
  ASSERT_TRUE(first && second);
  EXPECT_FALSE(first->sum_is_right);
  EXPECT_TRUE(second->sum_is_right);
  EXPECT_FALSE(framer.next());
}

TEST(PingFrames, AnyBytesSplitAnywhereLeaveTheNextFrameReadable) {
  std::mt19937 draw(7);
  const Bytes good = general(Id::device_information);
  constexpr int runs = test::is_sanitized ? 20000 : 1000000;  // under sanitizers devices_fuzz and hosts_fuzz try more inputs
  for (int run = 0; run < runs; ++run) {
    Bytes bytes(draw() % 24);
    for (std::byte& b : bytes) {
      static constexpr unsigned char likely[] = {0x42, 0x52, 0x00, 0x06, 0xff};
      b = std::byte{draw() % 2 == 0 ? likely[draw() % 5] : static_cast<unsigned char>(draw())};
    }
    // After a false start the device may wait for as many bytes as the longest request has, so that many zeros come before the
    // valid request.
    bytes.insert(bytes.end(), longest_request + header_size + sum_size, std::byte{});
    bytes.insert(bytes.end(), good.begin(), good.end());
    Framer framer;
    bool found = false;
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t size = std::min<std::size_t>(1 + draw() % 200, bytes.size() - at);
      framer.append(BytesView(bytes).subspan(at, size));
      at += size;
      while (const auto frame = framer.next()) found |= frame->sum_is_right && frame->header.id == Id::general_request;
      ASSERT_LT(framer.waiting_bytes(), 512u);
    }
    ASSERT_TRUE(found) << run;
  }
}

TEST(PingFrames, ReturnsThePlaceOfAFrame) {
  const Bytes good = general(Id::device_information);
  Framer framer(65535);
  std::uint64_t at = 0;
  for (int i = 0; i < 1000; ++i) {
    const Bytes junk(static_cast<std::size_t>(i % 7), std::byte{0x42});
    framer.append(junk);
    framer.append(good);
    at += junk.size() + good.size();
    const auto frame = framer.next();
    ASSERT_TRUE(frame && frame->sum_is_right);
    ASSERT_EQ(framer.passed(), at);
    ASSERT_TRUE(std::equal(good.begin(), good.end(), framer.bytes().begin(), framer.bytes().end()));
  }
  framer.append(hex("42 52 20 00"));
  framer.drop_rest();
  EXPECT_EQ(framer.passed(), at + 4);
  EXPECT_EQ(framer.waiting_bytes(), 0u);
}

TEST(PingFrames, InADatagramAFalseStartHidesNoFrame) {
  Bytes bytes = hex("42 52 20 00");
  const Bytes good = general(Id::protocol_version);
  bytes.insert(bytes.end(), good.begin(), good.end());
  Framer stream, datagram(longest_request, true);
  stream.append(bytes);
  datagram.append(bytes);
  EXPECT_FALSE(stream.next()) << "more bytes of a stream may come";
  const auto found = datagram.next();
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->sum_is_right);
  EXPECT_EQ(found->header.id, Id::general_request);
  EXPECT_TRUE(holds_frame(bytes));
}

TEST(PingFrames, OnlyDatagramsOfHostsOpenADialogue) {
  EXPECT_TRUE(holds_frame(general(Id::protocol_version)));
  EXPECT_FALSE(holds_frame(ack(Id::motor_off, 2))) << "the message is one of another device";
  EXPECT_FALSE(holds_frame(nack(Id::motor_off, 2, "no")));
  EXPECT_FALSE(holds_frame({}));
  EXPECT_FALSE(holds_frame(hex("00 FF")));
  Bytes wrong = general(Id::protocol_version);
  wrong.back() = std::byte{0x55};
  EXPECT_FALSE(holds_frame(wrong));
}

}  // namespace
}  // namespace sonar::ping
