// The folder of rendered pings: one run at a time, one set of inputs, whole files only.
#include "daemon/commands/render/output_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/small_disk.hpp"

namespace sonar::render {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class OutputFolders : public testing::Test {
 protected:
  OutputFolders() {
    options_.folder = std::filesystem::path(testing::TempDir()) / "output_folder_test";
    options_.npy = false;
    std::filesystem::remove_all(options_.folder);
  }
  ~OutputFolders() override { std::filesystem::remove_all(options_.folder); }
  Result<OutputFolder> claim(const std::string& digest) {
    return OutputFolder::claim({"r.yaml", {}, "", notes_}, options_, digest);
  }
  void put(const std::string& name, const std::string& text) { std::ofstream(options_.folder / name) << text; }
  std::string about() {
    std::ifstream in(options_.folder / "render.json");
    return {std::istreambuf_iterator<char>(in), {}};
  }

  OutputOptions options_;
  std::vector<std::string> notes_;
  const std::string sidecar_ = R"({"sonard": "0.1.0", "inputs": "x", "ping": 1, "settings": {}})";
};

TEST_F(OutputFolders, IsHeldByOneRunAtATime) {
  {
    const auto first = claim("a");
    ASSERT_TRUE(first);
    const auto second = claim("a");
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().kind, ErrorKind::usage);
    EXPECT_THAT(second.error().text, AllOf(HasSubstr("another sonard render is writing"), HasSubstr("output_folder_test")));
    options_.overwrite = true;
    EXPECT_FALSE(claim("b")) << "overwrite does not help while the first run holds the folder";
  }
  EXPECT_TRUE(claim("b")) << "the first run has ended";
}

TEST_F(OutputFolders, NeverMixesThePingsOfTwoInputs) {
  ASSERT_TRUE(claim("a"));
  put("000001.png", "picture");
  put("notes.txt", "not ours");
  ASSERT_TRUE(claim("a"));
  EXPECT_THAT(claim("b").error().text, HasSubstr("holds pings of other inputs"));
  std::filesystem::remove(options_.folder / "render.json");
  put("000001.json", sidecar_);
  EXPECT_THAT(claim("a").error().text, HasSubstr("no render.json")) << "the inputs of the pings are unknown";
  EXPECT_TRUE(std::filesystem::exists(options_.folder / "000001.png"));
  options_.overwrite = true;
  ASSERT_TRUE(claim("b"));
  EXPECT_FALSE(std::filesystem::exists(options_.folder / "000001.png"));
  EXPECT_TRUE(std::filesystem::exists(options_.folder / "notes.txt"));
}

TEST_F(OutputFolders, FilesOfOthersAreNotRemovedEvenIfTheyHaveNumbers) {
  std::filesystem::create_directories(options_.folder);
  options_.overwrite = true;
  put("000001.png", "ours");
  put("000001.json", sidecar_);
  put("000002.png", "a camera's");
  EXPECT_THAT(claim("a").error().text, AllOf(HasSubstr("000002.png may not be from sonard"), HasSubstr("--out")));
  put("000002.json", R"({"camera": 2})");
  EXPECT_FALSE(claim("a"));
  EXPECT_TRUE(std::filesystem::exists(options_.folder / "000001.png"));
  EXPECT_TRUE(std::filesystem::exists(options_.folder / "000002.png"));
  std::filesystem::remove(options_.folder / "000002.png");
  std::filesystem::remove(options_.folder / "000002.json");
  put("render.json", "{}");
  EXPECT_THAT(claim("a").error().text, HasSubstr("render.json was not written by sonard"));
  std::filesystem::remove(options_.folder / "render.json");
  EXPECT_TRUE(claim("a"));
  EXPECT_FALSE(std::filesystem::exists(options_.folder / "000001.png"));
}

TEST_F(OutputFolders, HoldsAPingIfItHasAllFilesOfThePingWithTheseInputs) {
  const auto folder = claim("a");
  ASSERT_TRUE(folder);
  EXPECT_FALSE(folder->holds(7));
  put("000007.json", R"({"inputs": "a"})");
  EXPECT_FALSE(folder->holds(7)) << "the picture is missing";
  put("000007.png", "picture");
  EXPECT_TRUE(folder->holds(7));
  EXPECT_EQ(folder->size_of(7), 22u);
  put("000007.json", R"({"inputs": "b"})");
  EXPECT_FALSE(folder->holds(7));
}

TEST_F(OutputFolders, ReportsDecisionsAboutTheInputs) {
  ASSERT_TRUE(claim("a"));
  EXPECT_THAT(about(), testing::Not(HasSubstr("notes")));
  notes_ = {"the poses are snapshots"};
  ASSERT_TRUE(claim("a"));
  EXPECT_THAT(about(), AllOf(HasSubstr("notes"), HasSubstr("the poses are snapshots")));
}

TEST_F(OutputFolders, AFullDiskIsAnErrorWithTheFilesNameAndLeavesNothingHalf) {
  ASSERT_TRUE(claim("a"));
  const std::vector<std::byte> data(20000);
  const auto file = options_.folder / "000001_pressure.npy";
  {
    const SmallDisk disk(10000);
    const auto r = write_output(file, {data, data});
    ASSERT_FALSE(r);
    EXPECT_EQ(r.error().kind, ErrorKind::io);
    EXPECT_THAT(r.error().text, AllOf(HasSubstr("000001_pressure.npy: File too large"), HasSubstr("make room")));
  }
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_FALSE(std::filesystem::exists(file.string() + ".tmp"));
  ASSERT_TRUE(write_output(file, {data, data}));
  EXPECT_EQ(std::filesystem::file_size(file), 40000u);
}

}  // namespace
}  // namespace sonar::render
