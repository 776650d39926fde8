#include <gtest/gtest.h>

#include "tests/protocol/blueview/blueview_testing.hpp"

namespace sonar::blueview {
namespace {

using test::at_s;

TEST(BlueViewFrames, HeaderIsSixteenBytesLittleEndian) {
  const wire::Bytes header = make_header(FrameType::ping_data, 0x01020304, 0x00A0B0C0);
  const std::vector<int> expected{'B', 'V', 'E', '1', 0x04, 0x80, 0, 0, 4, 3, 2, 1, 0xC0, 0xB0, 0xA0, 0};
  ASSERT_EQ(header.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(std::to_integer<int>(header[i]), expected[i]) << i;
}

TEST(BlueViewFrames, AnySplitGivesTheSameFrames) {
  wire::Bytes stream = test::hello();
  for (const wire::Bytes& more : {test::get(2, 0, Key::gain), test::request(FrameType::keep_alive, 0)})
    stream.insert(stream.end(), more.begin(), more.end());
  for (std::size_t cut = 1; cut < 20; ++cut) {
    Framer framer;
    std::vector<std::uint32_t> ids;
    for (std::size_t from = 0; from < stream.size(); from += cut) {
      framer.append(wire::BytesView(stream).subspan(from, std::min(cut, stream.size() - from)));
      while (const auto frame = framer.next()) ids.push_back(frame->header.request_id);
    }
    EXPECT_EQ(ids, (std::vector<std::uint32_t>{1, 2, 0})) << cut;
    EXPECT_TRUE(framer.broken().empty());
  }
}

TEST(BlueViewFrames, WrongLettersAndHugeLengthsEndTheStream) {
  Framer wrong;
  wire::Bytes bytes = test::hello();
  bytes[0] = std::byte{'X'};
  wrong.append(bytes);
  EXPECT_FALSE(wrong.next());
  EXPECT_NE(wrong.broken().find("BVE1"), std::string::npos);

  Framer huge;
  huge.append(make_header(FrameType::set, 1, longest_request + 1));
  EXPECT_FALSE(huge.next());
  EXPECT_NE(huge.broken().find("70001"), std::string::npos);
}

TEST(BlueViewFrames, WrittenValuesAreReadBack) {
  for (const Value& value : {Value(std::int32_t{-5}), Value(2.5f), Value(std::string("front"))}) {
    wire::Bytes bytes;
    put_value(bytes, value);
    wire::Reader reader(bytes);
    const auto read = read_value(reader, Key::gain);
    ASSERT_TRUE(read);
    EXPECT_EQ(read->index(), value.index());
    EXPECT_EQ(reader.remaining(), 0u);
  }
  wire::Bytes cut;
  put_value(cut, Value(2.5f));
  cut.pop_back();
  wire::Reader reader(cut);
  EXPECT_FALSE(read_value(reader, Key::gain));
}

TEST(BlueViewDiscovery, AnswersOnlyItsOwnQuery) {
  const auto device = test::device();
  wire::Bytes question;
  for (const char c : {'B', 'V', 'E', '?'}) question.push_back(static_cast<std::byte>(c));
  question.push_back(std::byte{1});
  const auto answers = [&] { return vendor().on_datagram({}, question, device, Time{}).replies; };
  EXPECT_TRUE(answers().empty()) << "too short";
  question.push_back(std::byte{0});
  ASSERT_EQ(answers().size(), 1u);
  const protocol::Bytes answer = answers().front();
  ASSERT_GT(answer.size(), 8u);
  wire::Reader reader(answer);
  std::array<std::uint8_t, 4> letters{};
  std::uint16_t version = 0, port = 0;
  reader("letters", letters);
  reader("version", version);
  reader("port", port);
  EXPECT_EQ(letters[3], '!');
  EXPECT_EQ(version, 1);
  EXPECT_EQ(port, 14750);
  EXPECT_EQ(read_text(reader, "model"), "BlueView P900-90");
  EXPECT_EQ(read_text(reader, "serial"), "7001");
  question[4] = std::byte{2};
  EXPECT_TRUE(answers().empty()) << "a query of another version gets no answer";
}

}  // namespace
}  // namespace sonar::blueview
