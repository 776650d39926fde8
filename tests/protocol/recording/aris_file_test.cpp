// Tests .aris files by reading their fields at the vendor's offsets.
#include <cstdlib>
#include <cstring>

#include "protocol/aris/aris_file.hpp"
#include "protocol/aris/encode_frame.hpp"
#include "protocol/recording/recording.hpp"
#include "tests/protocol/recording/recording_testing.hpp"

namespace sonar::recording::aris_file_test {
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
    if (auto r = writer.write({tests::start, Origin::device, Carrier::datagram, part}); !r) return r;
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
  ASSERT_TRUE(writer->write({tests::start, Origin::device, Carrier::stream, Bytes(50)}));
  const auto changed = write(*writer, datagrams(4, 300));
  ASSERT_FALSE(changed);
  EXPECT_THAT(changed.error().text, ::testing::HasSubstr("settings were changed"));
  EXPECT_EQ(u32(file, 4), 2u) << "the number of frames is right before the file is closed";
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
    EXPECT_EQ(u32(file, at + 516), 1u) << "samples are in the order of the picture";
    for (std::size_t i = 0; i < 48 * 200u; ++i) ASSERT_EQ(file[at + 1024 + i], static_cast<std::byte>(i % 251));
  }
}

Bytes three_frames() {
  Bytes file;
  const auto writer = write_aris_file(sink_into(file));
  for (const std::int32_t index : {1, 2, 3}) EXPECT_TRUE(write(*writer, datagrams(index, 200)));
  EXPECT_TRUE(writer->close());
  return file;
}

/// The frames that were read, and the reported damage.
struct ReadBack {
  std::vector<aris::DecodedFrame> frames;
  std::string damage;
};
ReadBack read_back(Bytes file) {
  ReadBack read;
  auto opened = open_recording(source_from("f", std::move(file)));
  if (!opened) return {{}, opened.error().text};
  EXPECT_EQ(opened->format, ".aris file");
  for (int times = 0; times < 2; ++times, opened->reader->rewind()) {
    aris::FrameAssembler assembler;
    read.frames.clear();
    while (const auto message = opened->reader->next())
      if (auto frame = assembler.add(message->bytes)) read.frames.push_back(std::move(*frame));
    EXPECT_EQ(assembler.incomplete(), 0u);
    read.damage = opened->reader->damage() ? opened->reader->damage()->text : "";
  }
  return read;
}

TEST(ArisFile, IsReadAsTheDatagramsOfItsFrames) {
  const ReadBack read = read_back(three_frames());
  EXPECT_EQ(read.damage, "");
  ASSERT_EQ(read.frames.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(read.frames[i].index, static_cast<std::int32_t>(i + 1));
    EXPECT_EQ(read.frames[i].header.serial, 7001u);
    for (std::size_t k = 0; k < 48 * 200u; ++k) ASSERT_EQ(read.frames[i].picture[k], static_cast<std::byte>(k % 251));
  }
}

TEST(ArisFile, ErrorsOfDamagedFilesHaveTheOffset) {
  const Bytes whole = three_frames();
  const std::size_t record = 1024 + 48 * 200;
  Bytes file(whole.begin(), whole.end() - 100);
  ReadBack read = read_back(file);
  EXPECT_EQ(read.frames.size(), 2u);
  EXPECT_EQ(read.damage, "f: the file ends at byte 32796 within frame 3: only 10524 of its 10624 bytes are there");
  read = read_back(Bytes(whole.begin(), whole.end() - static_cast<std::ptrdiff_t>(record)));
  EXPECT_EQ(read.frames.size(), 2u);
  EXPECT_EQ(read.damage, "f: the file's header announces 3 frames, and the file holds 2");
  file = whole;
  file[1024 + record + 12] = std::byte{0};
  read = read_back(file);
  EXPECT_EQ(read.frames.size(), 2u);
  EXPECT_EQ(read.frames.back().index, 2) << "indexes have no gap";
  EXPECT_EQ(read.damage, "f: frame 2 at byte 11648 is damaged: its version or number of samples is not the file's");
  EXPECT_EQ(read_back(Bytes(whole.begin(), whole.begin() + 500)).damage, "f ends at byte 500, within its header");
  file = whole;
  file[16 + 1] = std::byte{77};
  EXPECT_EQ(read_back(file).damage, "f announces frames of 19760 beams and 200 samples, which no ARIS sends");
  EXPECT_FALSE(open_recording(source_from("f", whole), "front")) << "the file has one sonar without a name";
}

/// Reads a sample of the vendor, six frames of an ARIS 1200 (SONARD_CAPTURES).
TEST(ArisFile, ReadsARealFile) {
  const char* const folder = std::getenv("SONARD_CAPTURES");
  auto opened = open_recording(std::filesystem::path(folder == nullptr ? "" : folder) / "aris" / "sample.aris");
  if (folder == nullptr || !opened) GTEST_SKIP() << "SONARD_CAPTURES names no folder with aris/sample.aris";
  aris::FrameAssembler assembler;
  std::vector<Time> times;
  while (const auto message = opened->reader->next())
    if (const auto frame = assembler.add(message->bytes)) {
      times.push_back(message->at);
      EXPECT_EQ(frame->header.serial, 1098u);
      EXPECT_EQ(frame->picture.size(), 48 * 2000u);
    }
  EXPECT_FALSE(opened->reader->damage());
  ASSERT_EQ(times.size(), 6u);
  for (std::size_t i = 1; i < 6; ++i) EXPECT_NEAR(seconds(times[i] - times[i - 1]), 1 / 6.548, 1e-3);
}

}  // namespace
}  // namespace sonar::recording::aris_file_test
