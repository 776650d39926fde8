// A recording that is read for a viewer, until the viewer leaves.
#include "daemon/server/view/played_recording.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/protocol/recording/recording_testing.hpp"

namespace sonar {
namespace {

TEST(PlayedRecording, IsReadUntilItsViewerLeaves) {
  const auto bytes = recording::tests::recorded(recording::tests::Format::mcap, recording::tests::conversation());
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "run.mcap";
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  const auto left = std::make_shared<std::atomic<bool>>(false);
  auto pings = open_pings({file}, left);
  ASSERT_TRUE(pings);
  EXPECT_TRUE(pings->next());
  *left = true;
  EXPECT_THROW(static_cast<void>(open_pings({file}, left)), std::runtime_error);
}

}  // namespace
}  // namespace sonar
