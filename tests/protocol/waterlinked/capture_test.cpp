// Reads the 12 packets of a real unit's recording, which is stored outside the repository. Our encoder must write the same
// content.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "protocol/waterlinked/messages.hpp"
#include "tests/protocol/waterlinked/waterlinked_testing.hpp"

namespace sonar::waterlinked::tests {
namespace {

std::vector<Bytes> captured() {
  const char* const folder = std::getenv("SONARD_CAPTURES");
  if (folder == nullptr) return {};
  std::ifstream file(std::filesystem::path(folder) / "sonar3d15/ship_short.sonar", std::ios::binary);
  Bytes bytes;
  for (std::istreambuf_iterator<char> at(file), end; at != end; ++at) bytes.push_back(static_cast<std::byte>(*at));
  std::vector<Bytes> packets;
  for (std::size_t at = 0; at + 8 <= bytes.size();) {  // successive packets
    std::size_t size = 0;
    for (std::size_t b = 4; b-- > 0;) size = size << 8 | std::to_integer<std::size_t>(bytes[at + 4 + b]);
    if (size == 0 || at + size > bytes.size()) return {};
    packets.emplace_back(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.begin() + static_cast<std::ptrdiff_t>(at + size));
    at += size;
  }
  return packets;
}

TEST(WaterLinkedCapture, ContentIsEncodedToTheSameBytes) {
  const std::vector<Bytes> packets = captured();
  if (packets.empty()) GTEST_SKIP() << "SONARD_CAPTURES names no folder with sonar3d15/ship_short.sonar";
  ASSERT_EQ(packets.size(), 12u);
  for (std::size_t i = 0; i < packets.size(); ++i) {
    const auto content = rip_content(packets[i]);
    ASSERT_TRUE(content) << i;
    const Decoded message = decode(*content);
    ASSERT_EQ(message.ranges.has_value(), i % 2 == 0) << i;
    ASSERT_EQ(message.strengths.has_value(), i % 2 == 1) << i;
    const Shot& shot = message.ranges ? message.ranges->shot : message.strengths->shot;
    EXPECT_EQ(shot.sequence, 4448 + i / 2);
    EXPECT_EQ(shot.frequency, 5u);
    EXPECT_EQ(shot.speed_of_sound_mps, 1491);
    EXPECT_EQ(message.ranges ? packet_of(*message.ranges) : packet_of(*message.strengths), *content) << i;
    EXPECT_EQ(rip_content(rip_packet(*content)), content);
  }
}

}  // namespace
}  // namespace sonar::waterlinked::tests
