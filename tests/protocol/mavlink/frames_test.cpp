// Tests that frames of both versions are found between other frames and other bytes, that damaged frames are refused, and that
// every length is checked.
#include "tests/protocol/mavlink/mavlink_testing.hpp"

namespace sonar::mavlink {
namespace {

struct Read {
  std::vector<Frame> frames;
  FrameCounts counts;
};
/// Reads from a buffer of exactly the size of the datagram, so that a sanitizer detects a read beyond it.
Read read(const Bytes& datagram) {
  const Bytes exact(datagram);
  FrameReader reader(exact);
  Read out;
  while (auto frame = reader.next()) out.frames.push_back(*frame);
  out.counts = reader.counts();
  return out;
}

TEST(MavlinkFrames, TheChecksumIsThatOfMcrf4xx) {
  Bytes digits;
  for (const char c : std::string("123456789")) digits.push_back(static_cast<std::byte>(c));
  EXPECT_EQ(checksum(digits), 0x6F91) << "the check value of CRC-16/MCRF4XX";
}

TEST(MavlinkFrames, ReadsSeveralFramesOfBothVersionsFromOneDatagram) {
  Sender v;
  const Bytes first = v(autopilot_heartbeat()), second = v.version_1(local(7, 1, 2, 3)), third = v(attitude(8, 0.5f));
  const Read r = read(first + second + third);
  ASSERT_EQ(r.frames.size(), 3u);
  EXPECT_EQ(r.frames[0].id, Heartbeat::id);
  EXPECT_EQ(message_in<Heartbeat>(r.frames[0]).autopilot, 3);
  EXPECT_EQ(r.frames[1].version, 1);
  EXPECT_EQ(message_in<LocalPositionNed>(r.frames[1]).down_m, 3);
  EXPECT_EQ(message_in<Attitude>(r.frames[2]).yaw_rad, 0.5f);
  EXPECT_EQ(r.frames[2].sequence, 2);
  EXPECT_EQ(r.counts.frames, 3u);
  EXPECT_EQ(r.counts.junk_bytes, 0u);
}

TEST(MavlinkFrames, TrailingZerosAreOmittedAndRestored) {
  Sender v;
  const Bytes frame = v(local(9, 5, 0, 0));
  EXPECT_EQ(frame.size(), 10u + 8u + 2u) << "4 bytes of time, 4 of north";
  const Read r = read(frame);
  ASSERT_EQ(r.frames.size(), 1u);
  EXPECT_EQ(message_in<LocalPositionNed>(r.frames[0]).north_m, 5);
  EXPECT_EQ(message_in<LocalPositionNed>(r.frames[0]).down_mps, 0);
  EXPECT_EQ(v(local(0, 0, 0, 0)).size(), 10u + 1u + 2u) << "one byte stays, as the protocol requires";
}

TEST(MavlinkFrames, SignaturesAreSkipped) {
  Sender v;
  Bytes frame = v(local(9, 5, 6, 7));
  frame[2] = std::byte{0x01};
  const std::uint16_t crc =
      checksum(std::array{std::byte{LocalPositionNed::crc_extra}}, checksum(BytesView(frame).subspan(1, frame.size() - 3)));
  frame[frame.size() - 2] = static_cast<std::byte>(crc & 0xFF);
  frame[frame.size() - 1] = static_cast<std::byte>(crc >> 8);
  const Read r = read(frame + Bytes(13, std::byte{0xFD}) + v(attitude(1, 1)));
  ASSERT_EQ(r.frames.size(), 2u);
  EXPECT_EQ(r.counts.junk_bytes, 0u);
  EXPECT_EQ(read(frame + Bytes(12, std::byte{1})).frames.size(), 0u) << "one byte of the signature is missing";
}

TEST(MavlinkFrames, FramesWithUnknownMessagesOrFlagsAreSkippedWhole) {
  Sender v;
  Bytes flagged = v(attitude(1, 1));
  flagged[2] = std::byte{0x02};
  const Read r = read(framed(30001, 17, Bytes(40, std::byte{0xFE}), v.who) + flagged + v(attitude(2, 1)));
  ASSERT_EQ(r.frames.size(), 1u);
  EXPECT_EQ(r.counts.unknown, 2u);
  EXPECT_EQ(r.counts.junk_bytes, 0u);
}

TEST(MavlinkFrames, JunkIsCountedAndHidesNoFrame) {
  Sender v;
  const Bytes good = v(attitude(1, 1));
  for (const Bytes& junk : {bytes({1, 2, 3}), bytes({0xFD, 200, 0, 0}), bytes({0xFE, 0xFF, 9, 9, 9, 30, 0, 0}),
                            bytes({0xFD, 4, 0, 0, 1, 1, 1, 0x99, 0x99, 0x99}), bytes({0xFE, 0xFD, 0xFE})}) {
    const Read r = read(junk + good);
    ASSERT_EQ(r.frames.size(), 1u) << junk.size();
    EXPECT_EQ(r.counts.junk_bytes + r.counts.bad_checksum, junk.size());
    EXPECT_EQ(read(good + junk).frames.size(), 1u);
  }
}

TEST(MavlinkFrames, EveryFlippedBitIsDetected) {
  Sender v;
  const Bytes good = v(odometry(123456, 3));
  for (std::size_t i = 0; i < good.size(); ++i)
    for (int bit = 0; bit < 8; ++bit) {
      Bytes bad = good;
      bad[i] ^= static_cast<std::byte>(1 << bit);
      EXPECT_TRUE(read(bad).frames.empty()) << "byte " << i << ", bit " << bit;
    }
}

TEST(MavlinkFrames, EveryTruncationIsDetected) {
  Sender v;
  for (const Bytes& good : {v(odometry(123456, 3)), v.version_1(local(1, 2, 3, 4))})
    for (std::size_t n = 0; n < good.size(); ++n)
      EXPECT_TRUE(read(Bytes(good.begin(), good.begin() + static_cast<long>(n))).frames.empty());
}

TEST(MavlinkFrames, Version1FramesMustHaveTheFullLength) {
  Bytes shorter{std::byte{0xFE},         std::byte{2}, std::byte{0}, std::byte{1}, std::byte{1},
                std::byte{Attitude::id}, std::byte{9}, std::byte{9}};
  const std::uint16_t crc = checksum(std::array{std::byte{Attitude::crc_extra}}, checksum(BytesView(shorter).subspan(1)));
  shorter.push_back(static_cast<std::byte>(crc & 0xFF));
  shorter.push_back(static_cast<std::byte>(crc >> 8));
  const Read r = read(shorter);
  EXPECT_TRUE(r.frames.empty());
  EXPECT_EQ(r.counts.wrong_size, 1u);
}

TEST(MavlinkFrames, LaterExtensionFieldsAreIgnored) {
  Sender v;
  Bytes payload;
  const LocalPositionNed m = local(1, 2, 3, 4);
  wire::append(payload, m);
  payload.insert(payload.end(), 20, std::byte{0xAB});
  const Read r = read(framed(LocalPositionNed::id, LocalPositionNed::crc_extra, payload, v.who));
  ASSERT_EQ(r.frames.size(), 1u);
  EXPECT_EQ(message_in<LocalPositionNed>(r.frames[0]).down_m, 4);
}

}  // namespace
}  // namespace sonar::mavlink
