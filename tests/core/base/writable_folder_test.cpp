// Folders in which no file can be created, even if the superuser has the permission. They are recognised without an attempt to
// write.
#include "core/base/regular_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

namespace sonar {
namespace {

using testing::HasSubstr;

TEST(WritableFolder, ATemporaryFolderIsOne) {
  EXPECT_EQ(why_no_files_in(testing::TempDir()), "");
  EXPECT_EQ(why_no_files_in("."), "");
}

TEST(WritableFolder, OtherPathsAreRefusedWithAReason) {
  EXPECT_EQ(why_no_files_in("/no/such/folder"), "is not a folder");
  EXPECT_EQ(why_no_files_in("/proc/self/exe"), "is not a folder");
  EXPECT_EQ(why_no_files_in("/dev/null"), "is not a folder");
  for (const char* const of_the_kernel : {"/proc", "/proc/self", "/sys", "/dev/pts"})
    if (std::filesystem::is_directory(of_the_kernel)) {
      EXPECT_THAT(why_no_files_in(of_the_kernel), HasSubstr("the kernel's own files")) << of_the_kernel;
      EXPECT_FALSE(std::ofstream(std::filesystem::path(of_the_kernel) / "new").is_open()) << of_the_kernel;
    }
}

dev_t file_system_of(const char* file) {
  struct stat status {};
  EXPECT_EQ(::stat(file, &status), 0) << file;
  return status.st_dev;
}

TEST(WritableFolder, DevicesHaveTheirs) {
  const dev_t devices = file_system_of("/dev");
  if (devices == file_system_of("/")) GTEST_SKIP() << "/dev is a folder like others here";
  EXPECT_THAT(why_no_files_in("/dev"), HasSubstr("is for devices"));
  if (::access("/dev/shm", W_OK) == 0 && file_system_of("/dev/shm") != devices) {
    EXPECT_EQ(why_no_files_in("/dev/shm"), "") << "it has a file system of its own";
  }
}

}  // namespace
}  // namespace sonar
