// Written pings are read back from recordings, also from files that were not closed or were cut. Other files are refused.
#include "clients/bvtsdk/core/recording.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/clients/bvtsdk/made_ping.hpp"

namespace sonar::bvt {
namespace {

const Bytes hello{1, 0, 7, 7, 7};

PolarPing ping_number(int n) {
  PolarPing p = make_ping(4, 6, 1, 0.5f, [&](int j, int k) { return 1000 * n + 10 * j + k; });
  p.number = static_cast<std::uint32_t>(n);
  p.time_s = 100 + n;
  return p;
}

struct Recording : testing::Test {
  std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
  std::string path = folder / "dive.son";
  Recording() { std::filesystem::create_directories(folder); }
  ~Recording() override { std::filesystem::remove_all(folder); }

  /// Writes pings 0, 1, 2 of head 0, ping 3 of head 1, and a position and a mark between them.
  static void fill(RecordingWriter& writer, const std::string& to) {
    ASSERT_EQ(writer.create(to, hello), success);
    ASSERT_EQ(writer.put_ping(0, ping_number(0), hello), success);
    ASSERT_EQ(writer.put_ping(0, ping_number(1), hello), success);
    NavData nav;
    nav.present = nav_depth | nav_text;
    nav.depth_m = 33;
    nav.text = "by the wall";
    ASSERT_EQ(writer.put_nav(nav, 101.5), success);
    ASSERT_EQ(writer.put_ping(1, ping_number(3), hello), success);
    ASSERT_EQ(writer.put_event({102.25, "mine", "a suspicious shape"}), success);
    ASSERT_EQ(writer.put_ping(0, ping_number(2), hello), success);
  }
  std::string read() const {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  void write(const std::string& bytes) const { std::ofstream(path, std::ios::binary) << bytes; }
};

void put_frame(std::string& file, FrameType type, const Bytes& payload) {
  Bytes frame;
  put_header(frame, {type, 0, 0, static_cast<std::uint32_t>(payload.size())});
  frame.insert(frame.end(), payload.begin(), payload.end());
  put(frame, static_cast<std::uint32_t>(crc32(0, frame.data(), static_cast<uInt>(frame.size()))));
  file.append(frame.begin(), frame.end());
}

void expect_all(RecordingReader& reader) {
  EXPECT_EQ(reader.hello(), hello);
  ASSERT_EQ(reader.ping_count(0), 3);
  ASSERT_EQ(reader.ping_count(1), 1);
  EXPECT_EQ(reader.ping_count(2), 0);
  PolarPing ping;
  for (const int n : {2, 0, 1}) {
    ASSERT_EQ(reader.read_ping(0, n, ping), success);
    EXPECT_EQ(ping.number, static_cast<std::uint32_t>(n));
    EXPECT_EQ(ping.samples, ping_number(n).samples);
    EXPECT_EQ(ping.time_s, 100 + n);
  }
  ASSERT_EQ(reader.read_ping(1, 0, ping), success);
  EXPECT_EQ(ping.number, 3u);
  EXPECT_EQ(ping.head, 1);
  NavData nav;
  double time_s = 0;
  ASSERT_EQ(reader.nav_count(), 1);
  ASSERT_EQ(reader.read_nav(0, nav, time_s), success);
  EXPECT_EQ(nav.depth_m, 33);
  EXPECT_EQ(nav.text, "by the wall");
  EXPECT_EQ(time_s, 101.5);
  EventMark mark;
  ASSERT_EQ(reader.event_count(), 1);
  ASSERT_EQ(reader.read_event(0, mark), success);
  EXPECT_EQ(mark.time_s, 102.25);
  EXPECT_EQ(mark.key, "mine");
  EXPECT_EQ(mark.text, "a suspicious shape");
}

TEST_F(Recording, PlaysBackWhatWasWritten) {
  RecordingWriter writer;
  fill(writer, path);
  EXPECT_EQ(writer.ping_count(0), 3);
  EXPECT_EQ(writer.count(FrameType::ping_data), 4);
  ASSERT_EQ(writer.close(), success);
  EXPECT_EQ(writer.close(), success);
  EXPECT_EQ(writer.size_bytes(), std::filesystem::file_size(path));
  RecordingReader reader;
  ASSERT_EQ(reader.open(path), success);
  EXPECT_TRUE(reader.has_index());
  EXPECT_EQ(reader.size_bytes(), std::filesystem::file_size(path));
  expect_all(reader);
  PolarPing ping;
  EXPECT_EQ(reader.read_ping(0, 3, ping), ping_number_too_large);
  EXPECT_EQ(reader.read_ping(0, -1, ping), ping_number_too_small);
  EXPECT_EQ(reader.read_ping(5, 0, ping), ping_number_too_large);
  EXPECT_TRUE(ping.samples.empty());
  NavData nav;
  double time_s;
  EventMark mark;
  EXPECT_EQ(reader.read_nav(1, nav, time_s), index_out_of_bounds);
  EXPECT_EQ(reader.read_event(-1, mark), index_out_of_bounds);
}

TEST_F(Recording, IsReadWhileItGrowsAndWithoutAnIndex) {
  RecordingWriter writer;
  fill(writer, path);
  RecordingReader reader;
  ASSERT_EQ(reader.open(path), success);
  EXPECT_FALSE(reader.has_index());
  expect_all(reader);
}

TEST_F(Recording, OpensUpToTheLastWholeFrameWhereverItIsCut) {
  {
    RecordingWriter writer;
    fill(writer, path);
  }
  const std::string whole = read();
  RecordingReader reader;
  int most = 0;
  for (std::size_t n = 0; n <= whole.size(); ++n) {
    write(whole.substr(0, n));
    std::string why;
    const Code code = reader.open(path, &why);
    if (n < 8 + 16 + hello.size() + 4) {
      ASSERT_EQ(code, file_header_bad) << n;
      EXPECT_THAT(why, testing::HasSubstr("dive.son"));
      continue;
    }
    ASSERT_EQ(code, success) << n;
    const int pings = reader.ping_count(0) + reader.ping_count(1);
    ASSERT_GE(pings, most);
    most = pings;
    PolarPing ping;
    for (int i = 0; i < reader.ping_count(0); ++i) ASSERT_EQ(reader.read_ping(0, i, ping), success);
  }
  EXPECT_EQ(most, 4);
  expect_all(reader);
}

TEST_F(Recording, NeverGivesAFrameThatWasChanged) {
  {
    RecordingWriter writer;
    fill(writer, path);
  }
  const std::string whole = read();
  RecordingReader reader;
  for (std::size_t at = 8; at < whole.size(); ++at) {
    std::string harmed = whole;
    harmed[at] = static_cast<char>(harmed[at] ^ 0x10);
    write(harmed);
    if (reader.open(path) != success) continue;
    PolarPing ping;
    for (int n = 0; n < reader.ping_count(0); ++n)
      if (reader.read_ping(0, n, ping) == success) {
        ASSERT_EQ(ping.samples, ping_number(n).samples) << at;
      }
  }
}

TEST_F(Recording, OtherFilesAreRefused) {
  RecordingReader reader;
  std::string why;
  EXPECT_EQ(reader.open(folder / "missing.son", &why), file_open);
  EXPECT_THAT(why, testing::HasSubstr("missing.son"));
  write("");
  EXPECT_EQ(reader.open(path, &why), file_header_bad);
  write(std::string(5000, 'S'));
  EXPECT_EQ(reader.open(path, &why), file_header_bad);
  EXPECT_THAT(why, testing::HasSubstr("proprietary"));
  EXPECT_EQ(reader.open(folder, &why), file_header_bad);
  int pipe[2];
  ASSERT_EQ(::pipe(pipe), 0);
  EXPECT_EQ(reader.open("/proc/self/fd/" + std::to_string(pipe[0]), &why), file_open);
  EXPECT_THAT(why, testing::HasSubstr("not a regular file"));
  ::close(pipe[0]), ::close(pipe[1]);
  RecordingWriter writer;
  fill(writer, path);
  ASSERT_EQ(writer.close(), success);
  std::string newer = read();
  newer[4] = 3;
  write(newer);
  EXPECT_EQ(reader.open(path, &why), file_too_new);
  EXPECT_THAT(why, testing::HasSubstr("version 3"));
  EXPECT_EQ(reader.ping_count(0), 0);
}

TEST_F(Recording, ReportsThatItCannotBeWritten) {
  RecordingWriter writer;
  EXPECT_EQ(writer.put_ping(0, ping_number(0), hello), file_not_open);
  EXPECT_EQ(writer.put_event({}), file_not_open);
  EXPECT_EQ(writer.create(folder / "no" / "folder.son", hello), file_create);
  EXPECT_EQ(writer.close(), success);
  if (std::filesystem::exists("/dev/full")) {
    EXPECT_EQ(writer.create("/dev/full", hello), file_write);
    EXPECT_FALSE(writer.is_open());
  }
}

TEST_F(Recording, HoldsPackedSamples) {
  PolarPing quiet = make_ping(256, 400, 1, 0.02f, [](int j, int k) { return (j * 7 + k * 13) % 50; });
  RecordingWriter writer;
  ASSERT_EQ(writer.create(path, hello), success);
  ASSERT_EQ(writer.put_ping(0, quiet, hello), success);
  EXPECT_LT(writer.size_bytes(), quiet.samples.size());  // less than half of the samples' size
  RecordingReader reader;
  ASSERT_EQ(reader.open(path), success);
  PolarPing ping;
  ASSERT_EQ(reader.read_ping(0, 0, ping), success);
  EXPECT_EQ(ping.samples, quiet.samples);
}

TEST_F(Recording, Version1IsRead) {
  std::string file("BVER\1\0\0\0", 8);
  put_frame(file, FrameType::hello_ok, hello);
  for (const int n : {0, 1}) put_frame(file, FrameType::ping_data, encode_ping(ping_number(n)));
  write(file);
  RecordingReader reader;
  ASSERT_EQ(reader.open(path), success);
  ASSERT_EQ(reader.ping_count(0), 2);
  PolarPing ping;
  ASSERT_EQ(reader.read_ping(0, 1, ping), success);
  EXPECT_EQ(ping.samples, ping_number(1).samples);
}

TEST_F(Recording, NamesThePingWhoseStreamIsDamaged) {
  std::string file("BVER\2\0\0\0", 8);
  put_frame(file, FrameType::hello_ok, hello);
  Bytes damaged = encode_ping(ping_number(0), Packing::planes);
  damaged.back() ^= 0xFF;
  put_frame(file, FrameType::ping_data, damaged);  // with a correct checksum
  put_frame(file, FrameType::ping_data, encode_ping(ping_number(1), Packing::planes));
  write(file);
  RecordingReader reader;
  ASSERT_EQ(reader.open(path), success);
  PolarPing ping;
  std::string why;
  EXPECT_EQ(reader.read_ping(0, 0, ping, &why), bad_ping);
  EXPECT_THAT(why, testing::AllOf(testing::HasSubstr("ping 0 of head 0"), testing::HasSubstr("zlib stream")));
  EXPECT_TRUE(ping.samples.empty());
  EXPECT_EQ(reader.read_ping(0, 1, ping), success);
}

TEST_F(Recording, KeepsTheSettingsOfEachPing) {
  const Bytes loud{1, 0, 9, 9}, quiet{1, 0, 5};
  RecordingWriter writer;
  ASSERT_EQ(writer.create(path, hello), success);
  ASSERT_EQ(writer.put_ping(0, ping_number(0), loud), success);
  ASSERT_EQ(writer.put_ping(1, ping_number(1), loud), success);
  const std::uint64_t before = writer.size_bytes();
  ASSERT_EQ(writer.put_ping(0, ping_number(2), loud), success);
  const std::uint64_t unchanged = writer.size_bytes() - before;
  ASSERT_EQ(writer.put_ping(0, ping_number(3), quiet), success);
  EXPECT_LE(writer.size_bytes() - before, 2 * unchanged + frame_header_size + quiet.size() + 4);
  for (const bool closed : {false, true}) {
    if (closed) {
      ASSERT_EQ(writer.close(), success);
    }
    RecordingReader reader;
    ASSERT_EQ(reader.open(path), success);
    EXPECT_EQ(reader.has_index(), closed);
    EXPECT_EQ(reader.hello(), hello);
    EXPECT_EQ(reader.hello_of_ping(0, 0), loud);
    EXPECT_EQ(reader.hello_of_ping(1, 0), loud);
    EXPECT_EQ(reader.hello_of_ping(0, 1), loud);
    EXPECT_EQ(reader.hello_of_ping(0, 2), quiet);
    EXPECT_EQ(reader.hello_of_ping(0, 3), hello);
    EXPECT_EQ(reader.ping_count(0), 3);
  }
}

TEST_F(Recording, StartsAnewWhenCreatedAgain) {
  RecordingWriter writer;
  fill(writer, path);
  ASSERT_EQ(writer.create(folder / "second.son", hello), success);
  ASSERT_EQ(writer.put_ping(0, ping_number(9), hello), success);
  ASSERT_EQ(writer.close(), success);
  RecordingReader reader;
  ASSERT_EQ(reader.open(path), success);
  EXPECT_TRUE(reader.has_index());  // the first file was closed normally
  expect_all(reader);
  ASSERT_EQ(reader.open(folder / "second.son"), success);
  EXPECT_EQ(reader.ping_count(0), 1);
  EXPECT_EQ(reader.nav_count(), 0);
}

}  // namespace
}  // namespace sonar::bvt
