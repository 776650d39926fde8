// Tests the framer with every split and every truncation, with all kinds of other bytes, and with wrong sizes.
#include "protocol/oculus/framer.hpp"

#include "core/base/random.hpp"
#include "tests/protocol/oculus/oculus_testing.hpp"

namespace sonar::oculus::tests {
namespace {

Bytes header_bytes(int type, int version, std::uint32_t payload) {
  MessageHeader header;
  header.type = static_cast<MessageType>(type);
  header.version = static_cast<std::uint16_t>(version);
  header.payload_size = payload;
  return wire::bytes_of(header);
}

std::vector<Bytes> cut(Sender sender, std::initializer_list<Bytes> pieces, std::uint64_t* skipped = nullptr) {
  Framer framer(sender);
  std::vector<Bytes> messages;
  for (const Bytes& piece : pieces) {
    framer.append(Exact(piece).view());
    while (const auto message = framer.next()) messages.emplace_back(message->begin(), message->end());
  }
  if (skipped != nullptr) *skipped = framer.skipped_bytes();
  return messages;
}

const Bytes short_fire = make_fire(fire(0, 2, PingRate::hz10, 0x49, 5, 50), 0, true);
const Bytes long_fire = make_fire(fire(2, 1, PingRate::hz15, 0x4D, 7, 30));
const Bytes dummy = header_bytes(0xFF, 0, 0);

TEST(Framer, EverySplitGivesTheSameMessages) {
  const Bytes stream = joined({short_fire, dummy, hex("30 30"), long_fire, header_bytes(0x55, 0, 0), Bytes(12)});
  const auto whole = cut(Sender::client, {stream});
  ASSERT_EQ(whole.size(), 4u);
  EXPECT_EQ(whole[0], short_fire);
  EXPECT_EQ(whole[2], long_fire);
  EXPECT_EQ(whole[3].size(), 28u);
  for (std::size_t i = 0; i <= stream.size(); ++i) {
    const Bytes first(stream.begin(), stream.begin() + static_cast<std::ptrdiff_t>(i));
    const Bytes second(stream.begin() + static_cast<std::ptrdiff_t>(i), stream.end());
    EXPECT_EQ(cut(Sender::client, {first, second}), whole) << "split at " << i;
  }
  Framer framer(Sender::client);
  std::vector<Bytes> bytewise;
  for (const std::byte b : stream) {
    framer.append(BytesView(&b, 1));
    while (const auto message = framer.next()) bytewise.emplace_back(message->begin(), message->end());
  }
  EXPECT_EQ(bytewise, whole);
}

TEST(Framer, ZeroPayloadMeansTheNaturalLength) {
  struct Case {
    int type, version;
    std::size_t length;
  };
  for (const Case& c : {Case{0x15, 0, 53}, Case{0x15, 1, 53}, Case{0x15, 2, 89}, Case{0x15, 3, 89}, Case{0x55, 0, 28},
                        Case{0xFF, 0, 16}, Case{0x99, 0, 16}})
    EXPECT_EQ(message_length(header_of(header_bytes(c.type, c.version, 0)), Sender::client), c.length) << c.type;
}

TEST(Framer, ClientPayloadsAreTrustedUpToTheirLimit) {
  EXPECT_EQ(message_length(header_of(header_bytes(0x15, 0, 37)), Sender::client), 53u);
  EXPECT_EQ(message_length(header_of(header_bytes(0x15, 0, 4096)), Sender::client), 4112u);
  EXPECT_EQ(message_length(header_of(header_bytes(0x15, 0, 4097)), Sender::client), std::nullopt);
  EXPECT_EQ(message_length(header_of(header_bytes(0x15, 0, 0xFFFFFFF0)), Sender::client), std::nullopt);
}

TEST(Framer, DeviceLengthsAreCapped) {
  EXPECT_EQ(message_length(header_of(header_bytes(0x23, 0, 182000)), Sender::device), 182016u);
  EXPECT_EQ(message_length(header_of(header_bytes(0x23, 0, 0xFFFFFFF0)), Sender::device), std::nullopt);
  EXPECT_EQ(message_length(header_of(header_bytes(0x23, 0, 0xFFFFFFFF)), Sender::device), std::nullopt);
}

TEST(Framer, JunkBetweenMessagesIsSkippedByteByByte) {
  const Bytes decoys[] = {hex("00"), hex("53"), hex("53 53"), hex("4F"), hex("30 30"), hex("53 4F 53"), Bytes(16), Bytes(1000)};
  for (const Bytes& junk : decoys) {
    std::uint64_t skipped = 0;
    const auto messages = cut(Sender::client, {joined({junk, short_fire, junk, dummy, short_fire})}, &skipped);
    // 53 4F 53 looks like a header, and the next bytes may count as its payload; the framer must still find the next message.
    ASSERT_FALSE(messages.empty());
    EXPECT_EQ(messages.back(), short_fire) << junk.size();
    if (junk != hex("53 4F 53")) {
      EXPECT_EQ(messages.size(), 3u);
      EXPECT_EQ(skipped, 2 * junk.size());
    }
  }
}

TEST(Framer, AHugeLengthCostsNoMemory) {
  Framer framer(Sender::client);
  for (int i = 0; i < 1000; ++i) {
    framer.append(header_bytes(0x15, 0, 0xFFFFFFF0));
    EXPECT_EQ(framer.next(), std::nullopt);
    EXPECT_LT(framer.buffered_bytes(), header_size);
  }
  framer.append(short_fire);
  EXPECT_TRUE(framer.next().has_value());
}

// Waiting bytes are always less than one message, for any input.
TEST(Framer, NeverKeepsMoreThanAMessage) {
  Framer framer(Sender::client);
  for (std::uint32_t i = 0; i < 20000; ++i) {
    const Random4 draw = philox(i, 0, 0, 0, 5, 0);
    Bytes piece = (draw.v[0] % 3 == 0) ? header_bytes(0x15, 0, draw.v[1] % 6000) : Bytes(draw.v[1] % 40);
    for (std::byte& b : piece)
      if (draw.v[0] % 3 == 1) b = static_cast<std::byte>(draw.v[2] % 2 == 0 ? 0x53 : 0x4F);
    framer.append(piece);
    while (framer.next()) {
    }
    ASSERT_LE(framer.buffered_bytes(), request_payload_limit + header_size);
  }
}

}  // namespace
}  // namespace sonar::oculus::tests
