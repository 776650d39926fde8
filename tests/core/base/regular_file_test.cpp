// Only regular files are opened. The error names any other kind of file, and opening never waits for a file of another kind.
#include "core/base/regular_file.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace sonar {
namespace {

using testing::HasSubstr;

struct RegularFile : testing::Test {
  RegularFile() { std::filesystem::create_directories(folder); }
  ~RegularFile() override { std::filesystem::remove_all(folder); }
  std::string refusal(const std::filesystem::path& file) {
    const auto opened = open_regular(file);
    if (opened) return "opened";
    EXPECT_EQ(opened.error().kind, ErrorKind::missing_file);
    return opened.error().text;
  }
  std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / ("regular-file-" + std::to_string(getpid()));
};

TEST_F(RegularFile, IsReadWholeOrOneByteBeyondTheLimit) {
  const auto file = folder / "a.txt";
  std::ofstream(file) << "four";
  EXPECT_EQ(*read_regular(file, 100), "four");
  EXPECT_EQ(*read_regular(file, 4), "four");
  EXPECT_EQ(*read_regular(file, 2), "fou") << "enough to see that it is too long";
  std::filesystem::create_symlink(file, folder / "link");
  EXPECT_EQ(*read_regular(folder / "link", 100), "four");
}

TEST_F(RegularFile, OtherKindsOfFilesAreNamed) {
  EXPECT_EQ(refusal(folder / "none"), (folder / "none").string() + ": cannot be opened: No such file or directory");
  EXPECT_THAT(refusal(folder), HasSubstr(": is a folder, not a regular file"));
  EXPECT_THAT(refusal("/dev/zero"), HasSubstr("/dev/zero: is a device, not a regular file"));
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_THAT(refusal(folder / "pipe"), HasSubstr("pipe: is a FIFO, not a regular file; save its contents in a regular file"));
  EXPECT_EQ(read_regular(folder / "pipe", 10).error().kind, ErrorKind::missing_file);
}

TEST_F(RegularFile, LinksThatLeadToNoFileAreExplained) {
  std::filesystem::create_symlink("round", folder / "round");
  std::filesystem::create_symlink("gone", folder / "link");
  EXPECT_THAT(refusal(folder / "round"), HasSubstr("round: cannot be opened: its links lead round in a circle, or are too many"));
  EXPECT_THAT(refusal(folder / "link"), HasSubstr("link: cannot be opened: it is a link to \"gone\", which does not exist"));
  EXPECT_THAT(refusal(folder), HasSubstr("; name a file in it"));
  for (const char* name : {"round", "link", "."}) EXPECT_FALSE(is_absent(folder / name)) << name;
  EXPECT_TRUE(is_absent(folder / "none"));
  std::ofstream(folder / "file") << "x";
  EXPECT_FALSE(is_absent(folder / "file"));
  EXPECT_TRUE(is_absent(folder / "file" / "below")) << "a file has nothing below it";
}

TEST_F(RegularFile, AFifoWithoutAReaderIsNotWaitedForWhenItIsToBeWritten) {
  const auto pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(open_to_write(pipe, O_CREAT), -1);
  EXPECT_EQ(why_not_written(pipe, errno), "it is a pipe that no program reads; start its reader first");
  EXPECT_EQ(why_not_written(folder / "none", ENXIO), std::strerror(ENXIO)) << "no FIFO: a socket, or a terminal that has closed";
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK), writer = open_to_write(pipe, O_CREAT);
  ASSERT_GE(writer, 0);
  EXPECT_EQ(::fcntl(writer, F_GETFL) & O_NONBLOCK, 0) << "a full pipe makes writers wait, no bytes are lost";
  ::close(writer), ::close(reader);
  const int file = open_to_write(folder / "new", O_CREAT);
  EXPECT_GE(file, 0);
  ::close(file);
}

TEST_F(RegularFile, AWriteErrorComesWithTheAdviceThatFitsIt) {
  const auto why = [&](int error) { return why_not_written(folder / "none", error); };
  EXPECT_EQ(why(ENOSPC), "No space left on device; make room");
  EXPECT_EQ(why(EFBIG), "File too large; make room");
  EXPECT_EQ(why(EACCES), "Permission denied; give this user the right to write there");
  EXPECT_EQ(why(EROFS), "Read-only file system; choose a place that can be written");
  EXPECT_EQ(why_not_written(folder / "none" / "file", ENOENT), "No such file or directory; make its folder first");
  EXPECT_EQ(why_not_written("file", ENOENT), "No such file or directory") << "the folder of a bare name is there";
  EXPECT_EQ(why(EIO), std::strerror(EIO));
}

}  // namespace
}  // namespace sonar
