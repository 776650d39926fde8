// Tests that a recording is read for a viewer until the viewer disconnects.
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

TEST(PlayedRecording, LinksOutOfTheFolderAreNotFollowed) {
  namespace fs = std::filesystem;
  const fs::path outside = fs::path(::testing::TempDir()) / "links", folder = outside / "recordings";
  fs::remove_all(outside);
  fs::create_directories(folder);
  const auto bytes = recording::tests::recorded(recording::tests::Format::mcap, recording::tests::conversation());
  for (const fs::path& file : {outside / "secret.mcap", folder / "run.mcap"})
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  fs::create_symlink(outside / "secret.mcap", folder / "out.mcap");
  fs::create_symlink("../secret.mcap", folder / "up.mcap");
  fs::create_symlink("run.mcap", folder / "latest.mcap");
  fs::create_symlink("nothing.mcap", folder / "dangling.mcap");
  fs::create_directory_symlink(folder, outside / "by-link");
  const auto left = std::make_shared<std::atomic<bool>>(false);
  const auto opens = [&](const fs::path& within, const char* name) {
    return open_pings({.file = within / name, .within = within}, left).has_value();
  };
  for (const fs::path& within : {folder, outside / "by-link"}) {
    EXPECT_TRUE(opens(within, "run.mcap"));
    EXPECT_TRUE(opens(within, "latest.mcap"));
    for (const char* name : {"out.mcap", "up.mcap", "dangling.mcap"}) EXPECT_FALSE(opens(within, name)) << name;
  }
  const auto refused = open_pings({.file = folder / "out.mcap", .within = folder}, left);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text.find("out.mcap: is a symbolic link out of the folder of recordings"), std::string::npos);
}

}  // namespace
}  // namespace sonar
