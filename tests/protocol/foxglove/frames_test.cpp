// Compares binary messages byte by byte with the examples of the protocol.
#include "protocol/foxglove/foxglove_frames.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sonar::foxglove {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using ::testing::HasSubstr;

std::string hex(const Bytes& bytes) {
  std::string text;
  for (const std::byte b : bytes) {
    text += "0123456789abcdef"[std::to_integer<unsigned>(b) >> 4];
    text += "0123456789abcdef"[std::to_integer<unsigned>(b) & 15];
  }
  return text;
}
Bytes bytes_of(std::string_view hex) {
  Bytes bytes;
  const auto digit = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes.push_back(static_cast<std::byte>(16 * digit(hex[i]) + digit(hex[i + 1])));
  return bytes;
}

TEST(FoxgloveFrames, FramesForViewersHaveTheirBytes) {
  EXPECT_EQ(hex(message_head(7, Time(milliseconds(1500)))), "0107000000002f685900000000");
  EXPECT_EQ(hex(time_frame(Time(milliseconds(41600)))), "0200a08daf09000000");
  EXPECT_EQ(hex(service_answer({5, 9, "json", "{}"})), "030500000009000000040000006a736f6e7b7d");
  EXPECT_EQ(hex(playback_frame({PlaybackStatus::playing, Time(nanoseconds(12345)), 1.0f, false, "i-am-a-request"})).substr(0, 38),
            "05003930000000000000"
            "0000803f"
            "00"
            "0e000000");
}

TEST(FoxgloveFrames, FramesOfViewersAreRead) {
  const auto call = frame_of_viewer(bytes_of("020500000009000000040000006a736f6e7b7d"));
  ASSERT_TRUE(call);
  const auto& requested = std::get<ServiceCall>(*call);
  EXPECT_EQ(requested.service, 5u);
  EXPECT_EQ(requested.call, 9u);
  EXPECT_EQ(requested.encoding, "json");
  EXPECT_EQ(requested.payload, "{}");
  const auto control = frame_of_viewer(bytes_of("03000000c03f01004d4466170000000700000061616161616161"));
  ASSERT_TRUE(control);
  const auto& playback = std::get<PlaybackControl>(*control);
  EXPECT_FALSE(playback.pause);
  EXPECT_EQ(playback.speed, 1.5f);
  EXPECT_TRUE(playback.seeks);
  EXPECT_EQ(playback.to.time_since_epoch(), nanoseconds(100500000000));
  EXPECT_EQ(playback.request, "aaaaaaa");
}

TEST(FoxgloveFrames, ShortAndUnknownFramesAreRefused) {
  const auto refusal = [](std::string_view hex) {
    const auto read = frame_of_viewer(bytes_of(hex));
    return read ? std::string("accepted") : read.error().text;
  };
  EXPECT_THAT(refusal(""), HasSubstr("opcode"));
  EXPECT_THAT(refusal("0205000000"), HasSubstr("call"));
  EXPECT_THAT(refusal("02050000000900000005000000aa"), HasSubstr("needs 5 bytes"));
  EXPECT_THAT(refusal("01"), HasSubstr("clientPublish"));
  EXPECT_THAT(refusal("09"), HasSubstr("opcode 9"));
  EXPECT_THAT(refusal("03020000c03f01004d44661700000000000000"), HasSubstr("wrong fields"));
}

}  // namespace
}  // namespace sonar::foxglove
