// Console lines while a scene loads: none if a step is short, else one at each interval.
#include "daemon/commands/options/load_progress.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <vector>

#include "core/base/load_step.hpp"

namespace sonar {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(LoadProgress, AShortLoadIsSilent) {
  int lines = 0;
  {
    const LoadProgress progress([&](const std::string&) { ++lines; }, 1h);
  }
  EXPECT_EQ(lines, 0);
}

TEST(LoadProgress, ALongLoadReportsStepPartAndSeconds) {
  std::mutex mutex;
  std::condition_variable said;
  std::vector<std::string> lines;
  const auto wait_for_a_line = [&] {
    std::unique_lock lock(mutex);
    const std::size_t before = lines.size();
    said.wait(lock, [&] { return lines.size() > before + 1; });  // one line may already have been in progress
    return lines.back();
  };
  begin_load_step("reading wreck.ply", 1'000'000);
  const LoadProgress progress(
      [&](const std::string& line) {
        const std::lock_guard lock(mutex);
        lines.push_back(line);
        said.notify_all();
      },
      1ms);
  EXPECT_THAT(wait_for_a_line(), StartsWith("loading the scene: reading wreck.ply, 0 s"));
  load_step_reached(0.456);
  EXPECT_THAT(wait_for_a_line(), HasSubstr("reading wreck.ply, 45 %, "));
  begin_load_step("building", 1'000'000);
  EXPECT_THAT(wait_for_a_line(), StartsWith("loading the scene: building, "));
}

TEST(LoadProgress, AShortStepAfterALongStepIsSilent) {
  begin_load_step("reading wreck.ply", 1'000'000);
  EXPECT_EQ(load_step().what, "reading wreck.ply");
  begin_load_step("a crate, which is small", 12);
  EXPECT_EQ(load_step().what, "");
}

}  // namespace
}  // namespace sonar
