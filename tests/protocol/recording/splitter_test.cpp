// Tests that for any split of the stream the splitter drops only bytes of broken messages.
#include "protocol/oculus/oculus.hpp"
#include "protocol/ping/messages.hpp"
#include "tests/protocol/recording/recording_testing.hpp"

namespace sonar::recording::tests {
namespace {

std::vector<Bytes> drain(MessageSplitter& splitter) {
  std::vector<Bytes> found;
  while (auto message = splitter.next()) found.push_back(std::move(message->bytes));
  return found;
}

Bytes joined(const std::vector<Bytes>& parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

TEST(MessageSplitter, FindsMessagesHoweverTheStreamIsCut) {
  const std::vector<Bytes> sent{dummy_message(), bytes_of("S S?SOno"), ping_message(1), dummy_message(), ping_message(2)};
  const Bytes stream = joined(sent);
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    MessageSplitter splitter(Origin::device, oculus::framing);
    splitter.append(after_ms(1), BytesView(stream).first(cut));
    std::vector<Bytes> found = drain(splitter);
    splitter.append(after_ms(2), BytesView(stream).subspan(cut));
    for (Bytes& part : drain(splitter)) found.push_back(std::move(part));
    EXPECT_EQ(joined(found), stream) << cut;
    for (const Bytes& message : {ping_message(1), ping_message(2)})
      EXPECT_THAT(found, ::testing::Contains(message)) << "cut at " << cut;
    EXPECT_EQ(splitter.losses(), 0u);
  }
}

TEST(MessageSplitter, LinesEndAtTheirLineEnd) {
  constexpr Framing lines{.magic = {'{', '"'}, .header_size = 2};
  const std::vector<Bytes> sent{bytes_of("xx"), bytes_of("{\"a\":1}\r\n"), bytes_of("{\"b\":2}\n")};
  const Bytes stream = joined(sent);
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    MessageSplitter splitter(Origin::device, lines);
    splitter.append(after_ms(1), BytesView(stream).first(cut));
    std::vector<Bytes> found = drain(splitter);
    splitter.append(after_ms(2), BytesView(stream).subspan(cut));
    for (Bytes& part : drain(splitter)) found.push_back(std::move(part));
    EXPECT_EQ(joined(found), stream) << cut;
    EXPECT_THAT(found, ::testing::IsSupersetOf({sent[1], sent[2]})) << cut;
  }
  MessageSplitter endless(Origin::device, lines);
  endless.append(after_ms(1), bytes_of("{\"" + std::string(70'000, 'a')));
  EXPECT_TRUE(endless.next()) << "a line that is too long is returned as bytes that are not a message";
}

TEST(MessageSplitter, TimeIsThatOfTheLastByte) {
  const Bytes ping = ping_message(1);
  MessageSplitter splitter(Origin::device, oculus::framing);
  splitter.append(after_ms(1), BytesView(ping).first(100));
  EXPECT_FALSE(splitter.next());
  splitter.append(after_ms(7), BytesView(ping).subspan(100));
  const auto message = splitter.next();
  ASSERT_TRUE(message);
  EXPECT_EQ(message->at, after_ms(7));
}

TEST(MessageSplitter, MissingBytesLoseOnlyTheirMessages) {
  const Bytes ping = ping_message(1), next = ping_message(2);
  MessageSplitter splitter(Origin::device, oculus::framing);
  splitter.append(start, BytesView(ping).first(500));
  EXPECT_TRUE(drain(splitter).empty());
  splitter.break_off();
  splitter.append(start, BytesView(ping).subspan(700));
  splitter.append(start, next);
  EXPECT_EQ(drain(splitter), std::vector<Bytes>{next});
  EXPECT_EQ(splitter.losses(), 1u);
  EXPECT_EQ(splitter.lost_bytes(), ping.size() - 200);
}

TEST(MessageSplitter, AfterLostBytesOnlyKnownFramesOfThePingProtocolAreAccepted) {
  const Framing& framing = *protocol::find_make("surveyor240")->codec.framing;
  const Bytes unknown = ping::framed(static_cast<ping::Id>(7777), 1, Bytes(9)), known = ping::framed(ping::Id::ack, 1, Bytes(2));
  MessageSplitter splitter(Origin::device, framing);
  splitter.append(start, unknown);
  EXPECT_EQ(drain(splitter), std::vector<Bytes>{unknown}) << "without lost bytes, an unknown message is accepted";
  splitter.break_off();
  splitter.append(start, unknown);
  splitter.append(start, known);
  EXPECT_EQ(drain(splitter), std::vector<Bytes>{known});
  EXPECT_EQ(splitter.lost_bytes(), unknown.size());
}

TEST(MessageSplitter, AnIncompleteMessageIsNotReturned) {
  const Bytes ping = ping_message(1);
  MessageSplitter splitter(Origin::device, oculus::framing);
  splitter.append(start, BytesView(ping).first(ping.size() - 1));
  splitter.finish();
  EXPECT_TRUE(drain(splitter).empty());
  EXPECT_EQ(splitter.losses(), 1u);
  EXPECT_EQ(splitter.lost_bytes(), ping.size() - 1);
}

TEST(MessageSplitter, ClientsMayOmitTheirPayloadSize) {
  Bytes fire = oculus::make_fire({});
  for (std::size_t i = 10; i < 14; ++i) fire[i] = std::byte{0};
  MessageSplitter splitter(Origin::client, oculus::framing);
  splitter.append(start, fire);
  splitter.append(start, fire);
  EXPECT_EQ(drain(splitter), (std::vector<Bytes>{fire, fire}));
}

}  // namespace
}  // namespace sonar::recording::tests
