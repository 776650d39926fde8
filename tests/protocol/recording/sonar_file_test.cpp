// Tests .sonar files: their packets and times, and the reports of damage.
#include <cstdlib>

#include "protocol/recording/recording.hpp"
#include "protocol/waterlinked/messages.hpp"
#include "tests/protocol/recording/recording_testing.hpp"

namespace sonar::recording::sonar_file_test {
namespace {

using ::testing::HasSubstr;

Time at_ms(std::int64_t ms) { return Time(std::chrono::hours(400'000) + std::chrono::milliseconds(ms)); }

Bytes images(std::uint32_t sequence) {
  waterlinked::Shot shot;
  shot.at = at_ms(200 * sequence);
  shot.sequence = sequence;
  shot.width = 16;
  shot.height = 8;
  Bytes both = waterlinked::rip_packet(waterlinked::packet_of(waterlinked::RangeMessage{shot, 0.001f, {128, sequence}}));
  const Bytes strengths = waterlinked::rip_packet(
      waterlinked::packet_of(waterlinked::StrengthMessage{shot, std::vector<std::uint8_t>(128, 7)}), waterlinked::Rip::one);
  both.insert(both.end(), strengths.begin(), strengths.end());
  return both;
}
Bytes joined(const std::vector<Bytes>& parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

struct ReadBack {
  std::vector<RecordedMessage> packets;
  std::string damage;
};
ReadBack read_back(Bytes file) {
  ReadBack read;
  auto opened = open_recording(source_from("f", std::move(file)));
  if (!opened) return {{}, opened.error().text};
  EXPECT_EQ(opened->format, ".sonar file");
  for (int times = 0; times < 2; ++times, opened->reader->rewind()) {
    read.packets.clear();
    while (auto packet = opened->reader->next()) read.packets.push_back(std::move(*packet));
    read.damage = opened->reader->damage() ? opened->reader->damage()->text : "";
  }
  return read;
}

TEST(SonarFile, HasTheDatagramsWithTheirTimes) {
  const Bytes other = waterlinked::rip_packet(Bytes(5, std::byte{0xFF}));  // a message of an unknown kind
  const Bytes file = joined({images(1), other, images(2)});
  const ReadBack read = read_back(file);
  EXPECT_EQ(read.damage, "");
  ASSERT_EQ(read.packets.size(), 5u);
  std::vector<Bytes> bytes;
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(read.packets[i].at, at_ms(i < 3 ? 200 : 400)) << i;
    EXPECT_EQ(read.packets[i].by, Carrier::datagram);
    bytes.push_back(read.packets[i].bytes);
  }
  EXPECT_EQ(joined(bytes), file);
}

TEST(SonarFile, DamageIsReportedWithTheOffsetAndSkipped) {
  const std::vector<Bytes> shots{images(1), images(2), images(3)};
  const Bytes whole = joined(shots);
  const std::string second = std::to_string(shots[0].size()), size = std::to_string(whole.size() - 1);
  ReadBack read = read_back(Bytes(whole.begin(), whole.end() - 1));
  EXPECT_EQ(read.packets.size(), 5u);
  EXPECT_THAT(read.damage, HasSubstr("f: the file ends at byte " + size + " within the packet at byte "));
  Bytes file = whole;
  file[shots[0].size() + 20] ^= std::byte{1};
  read = read_back(file);
  EXPECT_EQ(read.packets.size(), 5u);
  EXPECT_EQ(read.damage, "f: the packet at byte " + second + " is damaged: wrong CRC or compression");
  file = whole;
  file[shots[0].size() + 5] = std::byte{0xFF};  // a byte of the packet's length
  read = read_back(file);
  EXPECT_EQ(read.packets.size(), 5u) << "the next packet is found, even if this length is wrong";
  read = read_back(joined({shots[0], Bytes(100, std::byte{'R'}), shots[1], Bytes(3, std::byte{0})}));
  EXPECT_EQ(read.packets.size(), 4u);
  EXPECT_EQ(read.damage, "f: no packet begins at byte " + second + "; 1 more such place");
  EXPECT_FALSE(open_recording(source_from("f", whole), "front")) << "the file has one sonar without a name";
}

/// Reads the recording of a real unit (SONARD_CAPTURES).
TEST(SonarFile, ReadsARealFile) {
  const char* const folder = std::getenv("SONARD_CAPTURES");
  auto opened = open_recording(std::filesystem::path(folder == nullptr ? "" : folder) / "sonar3d15" / "ship_short.sonar");
  if (folder == nullptr || !opened) GTEST_SKIP() << "SONARD_CAPTURES names no folder with sonar3d15/ship_short.sonar";
  std::vector<Time> times;
  while (const auto packet = opened->reader->next()) times.push_back(packet->at);
  EXPECT_FALSE(opened->reader->damage());
  ASSERT_EQ(times.size(), 12u);
  for (std::size_t i = 2; i < 12; i += 2) EXPECT_NEAR(seconds(times[i] - times[i - 2]), 1.0 / 6, 2e-3);
}

}  // namespace
}  // namespace sonar::recording::sonar_file_test
