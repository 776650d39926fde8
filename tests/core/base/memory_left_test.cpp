// Memory that the computer and the control groups leave to the process. It is read from a folder of files that replaces /.
#include "core/base/memory_left.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace sonar {
namespace {

using testing::HasSubstr;

struct MemoryLeft : testing::Test {
  MemoryLeft() { memory_root() = root; }
  ~MemoryLeft() override {
    memory_root() = "/";
    std::filesystem::remove_all(root);
  }
  void write(const std::string& file, const std::string& text) const {
    std::filesystem::create_directories((root / file).parent_path());
    std::ofstream(root / file) << text;
  }
  const std::filesystem::path root = std::filesystem::path(testing::TempDir()) / ("memory-left-" + std::to_string(getpid()));
};

TEST_F(MemoryLeft, IsUnknownWithoutASource) {
  EXPECT_FALSE(memory_left_bytes());
  EXPECT_TRUE(check_memory_for("a scene", ~std::uint64_t{0}));
  memory_root() = "/";
  EXPECT_GT(memory_left_bytes().value_or(1), 0u);
}

TEST_F(MemoryLeft, TheComputerLimitsTheMemory) {
  write("proc/meminfo", "MemTotal:  9000 kB\nMemAvailable:    2000 kB\nSwapFree:  48 kB\n");
  EXPECT_EQ(memory_left_bytes(), 2048u * 1024);
}

TEST_F(MemoryLeft, GroupsOfVersion2AndTheirParentsLimitTheMemory) {
  write("proc/meminfo", "MemAvailable: 900000000 kB\n");
  write("proc/self/cgroup", "0::/system.slice/sonard.service\n");
  write("sys/fs/cgroup/system.slice/sonard.service/memory.max", "max\n");
  write("sys/fs/cgroup/system.slice/sonard.service/memory.current", "600\n");
  write("sys/fs/cgroup/system.slice/memory.max", "1000\n");
  write("sys/fs/cgroup/system.slice/memory.current", "700\n");
  write("sys/fs/cgroup/system.slice/memory.stat", "anon 1\nactive_file 5\ninactive_file 200\n");
  EXPECT_EQ(memory_left_bytes(), 500u) << "the cache can be given back";
  write("sys/fs/cgroup/system.slice/sonard.service/memory.max", "400\n");
  EXPECT_EQ(memory_left_bytes(), 0u) << "more used than allowed";
  write("proc/self/cgroup", "0::/\n");
  write("sys/fs/cgroup/memory.max", "5000\n");
  write("sys/fs/cgroup/memory.current", "1000\n");
  EXPECT_EQ(memory_left_bytes(), 4000u) << "in a container the group is the root";
}

TEST_F(MemoryLeft, GroupsOfVersion1LimitTheMemory) {
  write("proc/self/cgroup", "12:cpu,cpuacct:/x\n9:memory:/docker/ab\n0::/docker/ab\n");
  write("sys/fs/cgroup/memory/memory.limit_in_bytes", "3000000\n");  // the value visible from inside the group
  write("sys/fs/cgroup/memory/memory.usage_in_bytes", "1000000\n");
  write("sys/fs/cgroup/memory/memory.stat", "inactive_file 7\ntotal_inactive_file 500000\n");
  EXPECT_EQ(memory_left_bytes(), 2500000u);
  EXPECT_TRUE(check_memory_for("a scene", 2200000));
  const auto refused = check_memory_for("wreck.obj", 3000000);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::unavailable);
  EXPECT_THAT(refused.error().text, HasSubstr("wreck.obj would take about 2 MiB of memory, and 2 MiB are left"));
}

}  // namespace
}  // namespace sonar
