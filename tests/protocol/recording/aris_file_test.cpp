// .aris files: read back by hand at the vendor's offsets.
#include <cstring>

#include "protocol/aris/encode_frame.hpp"
#include "protocol/recording/aris_file.hpp"
#include "tests/protocol/recording/recording_testing.hpp"

namespace sonar::recording {
namespace {

std::vector<Bytes> datagrams(std::int32_t index, std::uint32_t samples) {
  aris::FrameHeader header;
  header.frame_index = 77;
  header.ping_mode = 1;
  header.samples_per_beam = samples;
  header.serial = 7001;
  Bytes picture(std::size_t{48} * samples);
  for (std::size_t i = 0; i < picture.size(); ++i) picture[i] = static_cast<std::byte>(i % 251);
  return aris::parts_of(index, wire::bytes_of(header), aris::raw_from_picture(picture, samples, 3));
}

Result<void> write(RecordingWriter& writer, const std::vector<Bytes>& parts) {
  for (const Bytes& part : parts)
    if (auto r = writer.write({testing::start, Origin::device, Carrier::datagram, part}); !r) return r;
  return {};
}

std::uint32_t u32(const Bytes& bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

TEST(ArisFile, HoldsWholeFramesInTheVendorsLayout) {
  Bytes file;
  const auto writer = write_aris_file(sink_into(file));
  auto parts = datagrams(1, 200);
  ASSERT_TRUE(write(*writer, parts));
  parts = datagrams(2, 200);
  parts.pop_back();
  ASSERT_TRUE(write(*writer, parts));
  ASSERT_TRUE(write(*writer, datagrams(3, 200)));
  ASSERT_TRUE(writer->write({testing::start, Origin::device, Carrier::stream, Bytes(50)}));
  const auto changed = write(*writer, datagrams(4, 300));
  ASSERT_FALSE(changed);
  EXPECT_THAT(changed.error().text, ::testing::HasSubstr("settings have changed"));
  EXPECT_EQ(u32(file, 4), 2u) << "before it is closed";
  ASSERT_TRUE(writer->close());
  ASSERT_EQ(file.size(), 1024 + 2 * (1024 + 48 * 200u));
  EXPECT_EQ(u32(file, 0), 0x05464444u);
  EXPECT_EQ(u32(file, 4), 2u);
  EXPECT_EQ(u32(file, 16), 48u);
  EXPECT_EQ(u32(file, 24), 200u);
  EXPECT_EQ(u32(file, 44), 7001u);
  for (std::size_t frame = 0; frame < 2; ++frame) {
    const std::size_t at = 1024 + frame * (1024 + 48 * 200);
    EXPECT_EQ(u32(file, at), frame);
    EXPECT_EQ(u32(file, at + 12), 0x05464444u);
    EXPECT_EQ(u32(file, at + 516), 1u) << "in the order of the picture";
    for (std::size_t i = 0; i < 48 * 200u; ++i) ASSERT_EQ(file[at + 1024 + i], static_cast<std::byte>(i % 251));
  }
}

}  // namespace
}  // namespace sonar::recording
