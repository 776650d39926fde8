// Tests .svlog files, which have a JSON text and then frames as they were sent.
#include <gmock/gmock.h>

#include "protocol/ping/messages.hpp"
#include "protocol/ping/ping_log.hpp"
#include "protocol/ping/s500_messages.hpp"
#include "protocol/recording/recording.hpp"
#include "tests/protocol/recording/recording_testing.hpp"

namespace sonar::recording::ping_log_test {
namespace {

std::string text_of(const Bytes& bytes) {
  std::string text;
  for (const std::byte b : bytes) text += static_cast<char>(b);
  return text;
}

TEST(PingLog, HasADescriptionBeforeTheFrames) {
  Bytes file;
  const auto writer = write_ping_log(sink_into(file));
  const Bytes sent = ping::framed_message(ping::Id::water_stats, 0, ping::WaterStats{12, 1.5f});
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(writer->write({tests::start, Origin::device, Carrier::stream, sent}));
  ASSERT_TRUE(writer->write({tests::start, Origin::device, Carrier::datagram, Bytes(7)}));
  ASSERT_TRUE(writer->write({tests::start, Origin::client, Carrier::stream, Bytes(7)}));
  ASSERT_TRUE(writer->close());
  ping::Framer framer(65535);
  framer.append(file);
  std::vector<ping::Frame> frames;
  while (auto frame = framer.next()) frames.push_back(std::move(*frame));
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(framer.waiting_bytes(), 0u);
  EXPECT_EQ(frames[0].header.id, ping::Id::json_wrapper);
  EXPECT_THAT(text_of(frames[0].payload), ::testing::HasSubstr("\"mbes24016\""));
  EXPECT_EQ(frames[2].header.id, ping::Id::water_stats);
}

Bytes log_of(std::uint32_t pings) {
  Bytes file;
  const auto writer = write_ping_log(sink_into(file));
  for (std::uint32_t i = 0; i < pings; ++i) {
    ping::AttitudeReport attitude;
    attitude.power_up_ms = 5000 + 100 * i;
    for (const Bytes& frame : {ping::framed_message(ping::Id::attitude_report, 0, attitude),
                               ping::framed_message(ping::Id::water_stats, 0, ping::WaterStats{12, 1.5f})})
      EXPECT_TRUE(writer->write({tests::start, Origin::device, Carrier::stream, frame}));
  }
  EXPECT_TRUE(writer->close());
  return file;
}

struct ReadBack {
  std::vector<RecordedMessage> messages;
  std::string damage;
};
ReadBack read_back(Bytes file) {
  ReadBack read;
  auto opened = open_recording(source_from("f", std::move(file)));
  if (!opened) return {{}, opened.error().text};
  EXPECT_EQ(opened->format, "ping protocol log");
  for (int times = 0; times < 2; ++times, opened->reader->rewind()) {
    read.messages.clear();
    while (auto message = opened->reader->next()) read.messages.push_back(std::move(*message));
    read.damage = opened->reader->damage() ? opened->reader->damage()->text : "";
  }
  return read;
}

TEST(PingLog, IsReadAsFramesWithTimesSincePowerUp) {
  const ReadBack read = read_back(log_of(3));
  EXPECT_EQ(read.damage, "");
  ASSERT_EQ(read.messages.size(), 6u) << "the description is not a message";
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(read.messages[i].at, Time(std::chrono::milliseconds(5000 + 100 * (i / 2))));
    EXPECT_EQ(read.messages[i].bytes.size(), i % 2 == 0 ? 46u : 18u);
  }
}

TEST(PingLog, AnS500HasItsNameAndTimes) {
  ping::Distance2 distance;
  distance.power_up_ms = 5000;
  ping::Profile6 profile;
  profile.power_up_ms = 5100;
  const Bytes frames[] = {ping::framed_message(ping::Id::s500_distance2, 0, distance),
                          ping::framed_message(ping::Id::s500_profile6, 0, profile)};
  for (const Bytes& first : frames) {
    Bytes file;
    const auto writer = write_ping_log(sink_into(file));
    ASSERT_TRUE(writer->write({tests::start, Origin::device, Carrier::stream, first}));
    for (const Bytes& frame : frames) ASSERT_TRUE(writer->write({tests::start, Origin::device, Carrier::stream, frame}));
    ASSERT_TRUE(writer->close());
    EXPECT_THAT(text_of(file), ::testing::HasSubstr("\"s500\""));
    const ReadBack read = read_back(file);
    EXPECT_EQ(read.damage, "");
    ASSERT_EQ(read.messages.size(), 3u);
    EXPECT_EQ(read.messages[1].at, Time(std::chrono::milliseconds(5000)));
    EXPECT_EQ(read.messages[2].at, Time(std::chrono::milliseconds(5100)));
  }
}

TEST(PingLog, ErrorsOfDamagedFilesHaveTheOffset) {
  const Bytes whole = log_of(3);
  const std::size_t text = whole.size() - 3 * 64;
  const auto bytes = [](std::size_t from, std::size_t to) {
    return "f: bytes " + std::to_string(from) + " to " + std::to_string(to) + " are not a whole frame";
  };
  ReadBack read = read_back(Bytes(whole.begin(), whole.end() - 5));
  EXPECT_EQ(read.messages.size(), 5u);
  EXPECT_EQ(read.damage, bytes(text + 174, whole.size() - 6));
  Bytes file = whole;
  file[text + 64 + 20] ^= std::byte{1};
  read = read_back(file);
  EXPECT_EQ(read.messages.size(), 5u);
  EXPECT_EQ(read.damage, bytes(text + 64, text + 109));
  file[text + 2] = std::byte{0xFF};  // a length beyond the end does not hide later frames
  file[text + 3] = std::byte{0xFF};
  EXPECT_EQ(read_back(file).damage, bytes(text, text + 45) + "; 1 more such place");
  EXPECT_THAT(read_back(Bytes(3, std::byte{'B'})).damage, ::testing::HasSubstr("is not a recording"));
  EXPECT_FALSE(open_recording(source_from("f", whole), "front")) << "the file has one sonar without a name";
}

}  // namespace
}  // namespace sonar::recording::ping_log_test
