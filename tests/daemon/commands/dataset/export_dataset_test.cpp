// Exports of a small data set, its split by scene, a stopped run, and damaged archives.
#include "daemon/commands/dataset/make_dataset.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "core/text/strict_yaml.hpp"
#include "daemon/commands/dataset/labelled_ping.hpp"
#include "daemon/commands/dataset/shards.hpp"

namespace sonar::dataset {
namespace export_dataset_test {

using nlohmann::json;
using std::filesystem::path;
using ::testing::HasSubstr;

// Beds, coats and radii alternate, so parts of scenes are repeated, and so are whole scenes.
const std::string job_text = R"(
dataset: {pings: 14, shard: 6, seed: 3, negatives: 0.3, targets: [ball], license: CC-BY-4.0}
vary:
  bed_seed: {list: [1, 2, 3]}
  radius: {list: [0.2, 0.3]}
  coat: {list: [steel, steel, steel, concrete]}
  stones: {integer: [0, 2]}
  texture: {list: [1, 2]}
  heading: {uniform: [-10, 10]}
let: {lift: radius - 12}
counts: {stone: $stones}
scene:
  materials:
    bed_sand: {like: sand, label: seabed, texture_seed: $texture, texture: {shape: 2, correlation_m: 0.5}}
  objects:
    - {name: bed, type: seabed, material: bed_sand, size_m: [12, 12], spacing_m: 0.5, seed: $bed_seed, pose: {xyz_m: [5, 0, -12]}}
    - {name: ball, label: ball, type: sphere, material: $coat, radius_m: $radius, segments: 24, pose: {xyz_m: [4, 0, $lift]}}
    - {name: stone, label: stone, type: rock, material: rock, size_m: [0.4, 0.4, 0.4], segments: 12, instances: [
        {xyz_m: [4.5, 1, -11.8]}, {xyz_m: [5, -1, -11.8]}]}
sonar: {ping: {range_m: 7, beams: 32, rows: 64}}
poses: {at: {frame: ENU_FLU, xyz_m: [0, 0, -10.5], rpy_deg: [0, 15, $heading]}}
)";

class ExportDataset : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("export_dataset_test." + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    auto job = parse_job(job_text, "small.yaml", folder_);
    ASSERT_TRUE(job) << job.error().text;
    job_ = *std::move(job);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Result<DatasetProgress> make(const std::string& out, const std::atomic<bool>* stop = nullptr, OnProgress see = {}) {
    if (!see) see = [](const DatasetProgress&) {};
    return make_dataset(job_, {.out = folder_ / out, .stop = stop}, see);
  }
  std::string contents(const path& file) const {
    std::ifstream in(folder_ / file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::size_t files_in(const path& folder) const {
    std::size_t n = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / folder)) n += entry.is_regular_file() ? 1 : 0;
    return n;
  }

  path folder_;
  DatasetJob job_;
};

TEST_F(ExportDataset, APingIsTheSameWhicheverPingsWereMadeBefore) {
  PingMaker all(job_, "inputs", {});
  for (std::uint64_t number = 1; number <= job_.pings; ++number) {
    PingMaker alone(job_, "inputs", {});
    const auto made = all.make(number), expected = alone.make(number);
    ASSERT_TRUE(made && expected) << (made ? expected : made).error().text;
    ASSERT_EQ(made->files.size(), expected->files.size());
    for (std::size_t i = 0; i < made->files.size(); ++i)
      EXPECT_TRUE(made->files[i] == expected->files[i]) << "ping " << number << ", " << made->files[i].first;
  }
}

TEST_F(ExportDataset, EqualScenesHaveEqualNames) {
  std::map<std::string, std::set<std::string>> draws_of;
  for (std::uint64_t number = 1; number <= job_.pings; ++number) {
    const auto ping = draw_ping(job_, number);
    ASSERT_TRUE(ping) << ping.error().text;
    const auto& words = ping->draws.words;
    draws_of[ping->scene_key].insert(words.at("bed_seed") + words.at("radius") + words.at("coat") + words.at("texture"));
  }
  std::set<std::string> all;
  for (const auto& [scene, draws] : draws_of) {
    EXPECT_EQ(draws.size(), 1u) << scene;
    all.insert(draws.begin(), draws.end());
  }
  EXPECT_EQ(all.size(), draws_of.size()) << "the name of a scene does not depend on sonar or counts";
  EXPECT_LT(draws_of.size(), job_.pings);
}

TEST_F(ExportDataset, NoSceneIsInTwoSplits) {
  ASSERT_TRUE(make("set"));
  const auto done = export_dataset(job_, folder_ / "set", ExportForm::coco, *parse_split("50,25,25", "bed_seed"));
  ASSERT_TRUE(done) << done.error().text;
  std::map<std::string, std::set<std::string>> splits_of_bed;
  std::size_t images = 0;
  for (const std::string split : {"train", "val", "test"}) {
    const json coco = json::parse(contents("set/coco/annotations/instances_" + split + ".json"));
    EXPECT_EQ(files_in("set/coco/" + split), coco["images"].size());
    for (const json& image : coco["images"]) {
      ++images;
      EXPECT_TRUE(std::filesystem::exists(folder_ / "set/coco" / split / image["file_name"].get<std::string>()));
      splits_of_bed[draw_ping(job_, image["id"])->draws.words.at("bed_seed")].insert(split);
    }
  }
  EXPECT_EQ(images, 14u);
  ASSERT_EQ(splits_of_bed.size(), 3u);
  for (const auto& [bed, splits] : splits_of_bed) EXPECT_EQ(splits.size(), 1u) << "bed " << bed;
  EXPECT_EQ(done->divided_scenes, 0u);
  EXPECT_THAT(contents("set/coco/README.md"), HasSubstr("Pings with equal bed_seed are in one split. None of the " +
                                                        std::to_string(done->scenes) + " scenes is"));
}

// A draw of the sonar, not of the scene, separates pings of equal scenes.
TEST_F(ExportDataset, TheCardCountsScenesThatADrawDivides) {
  ASSERT_TRUE(make("set"));
  const auto whole = export_dataset(job_, folder_ / "set", ExportForm::coco, *parse_split("50,25,25", ""));
  const auto done = export_dataset(job_, folder_ / "set", ExportForm::folder, *parse_split("50,25,25", "heading"));
  ASSERT_TRUE(whole && done);
  std::map<std::string, std::set<std::string>> splits_of_scene;
  for (const std::string split : {"train", "val", "test"})
    for (const auto& file : std::filesystem::directory_iterator(folder_ / "set/folder" / split / "samples"))
      splits_of_scene[draw_ping(job_, std::stoull(file.path().stem()))->scene_key].insert(split);
  const auto divided = std::ranges::count_if(splits_of_scene, [](const auto& scene) { return scene.second.size() > 1; });
  ASSERT_GT(divided, 0);
  EXPECT_EQ(done->scenes, splits_of_scene.size());
  EXPECT_EQ(done->divided_scenes, static_cast<std::size_t>(divided));
  EXPECT_EQ(std::make_pair(whole->scenes, whole->divided_scenes), std::make_pair(done->scenes, std::size_t{0}));
  EXPECT_THAT(contents("set/coco/README.md"), HasSubstr("\nNone of the " + std::to_string(done->scenes) + " scenes is in two"));
  EXPECT_THAT(contents("set/folder/README.md"), HasSubstr("Of the " + std::to_string(done->scenes) + " scenes " +
                                                          std::to_string(divided) + " have pings in two or"));
}

// The fields of the published format (cocodataset.org, "Data format": object detection) with their types.
TEST_F(ExportDataset, CocoHasTheFieldsOfItsFormat) {
  ASSERT_TRUE(make("set"));
  ASSERT_TRUE(export_dataset(job_, folder_ / "set", ExportForm::coco, *parse_split("100,0,0", "")));
  const json coco = json::parse(contents("set/coco/annotations/instances_train.json"));
  EXPECT_TRUE(coco["info"]["description"].is_string() && coco["info"]["version"].is_string());
  EXPECT_EQ(coco["licenses"][0]["name"], "CC-BY-4.0");
  std::map<std::uint64_t, json> images;
  std::set<std::uint64_t> categories, ids;
  for (const json& c : coco["categories"]) categories.insert(c["id"].get<std::uint64_t>()), c["name"].get<std::string>();
  for (const json& i : coco["images"]) {
    images[i["id"].get<std::uint64_t>()] = i;
    EXPECT_EQ(i["license"], 1);
  }
  EXPECT_EQ(images.size(), 14u);
  ASSERT_GT(coco["annotations"].size(), 3u);
  for (const json& a : coco["annotations"]) {
    EXPECT_TRUE(ids.insert(a["id"].get<std::uint64_t>()).second);
    EXPECT_TRUE(categories.contains(a["category_id"].get<std::uint64_t>()));
    ASSERT_TRUE(images.contains(a["image_id"].get<std::uint64_t>()));
    const json& image = images[a["image_id"].get<std::uint64_t>()];
    EXPECT_EQ(a["iscrowd"], 0);
    EXPECT_GT(a["area"], 0);
    EXPECT_LE(a["bbox"][0].get<int>() + a["bbox"][2].get<int>(), image["width"].get<int>());
    EXPECT_LE(a["bbox"][1].get<int>() + a["bbox"][3].get<int>(), image["height"].get<int>());
    for (const json& polygon : a["segmentation"]) EXPECT_TRUE(polygon.size() >= 6 && polygon.size() % 2 == 0);
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "set/coco/val")) << "a split without a share has no folder";
}

TEST_F(ExportDataset, FoldersHaveTheBytesOfTheShards) {
  ASSERT_TRUE(make("set"));
  const auto done = export_dataset(job_, folder_ / "set", ExportForm::folder, {});
  ASSERT_TRUE(done) << done.error().text;
  std::map<std::string, std::string> in_shards, in_folders;
  for (const char* shard : {"set/shard-000000.tar", "set/shard-000001.tar", "set/shard-000002.tar"})
    ASSERT_TRUE(read_archive(folder_ / shard, [&](const std::string& name, std::span<const std::byte> bytes) -> Result<void> {
      in_shards[name] = {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
      return {};
    }));
  std::size_t lines = 0;
  for (const std::string split : {"train", "val", "test"}) {
    for (const std::string kind : {"samples", "labels", "share", "caster", "json"})
      for (const auto& entry : std::filesystem::directory_iterator(folder_ / "set/folder" / split / kind)) {
        const path file = entry.path();
        in_folders[file.stem().string() + "." + kind + (kind == "json" ? "" : file.extension().string())] =
            contents(file.lexically_relative(folder_));
      }
    std::istringstream metadata(contents("set/folder/" + split + "/metadata.jsonl"));
    for (std::string line; std::getline(metadata, line); ++lines) {
      const json row = json::parse(line);
      EXPECT_TRUE(std::filesystem::exists(folder_ / "set/folder" / split / row["file_name"].get<std::string>()));
      EXPECT_EQ(row["objects"]["bbox"].size(), row["objects"]["category"].size());
    }
  }
  EXPECT_EQ(lines, 14u);
  EXPECT_EQ(in_shards.size(), 70u);
  EXPECT_EQ(in_folders, in_shards);
  EXPECT_THAT(contents("set/folder/README.md"), HasSubstr("  - split: validation\n    path:\n    - \"val/metadata.jsonl\""));
}

TEST_F(ExportDataset, CardsBeginWithAHeadInYaml) {
  ASSERT_TRUE(make("set"));
  ASSERT_TRUE(export_dataset(job_, folder_ / "set", ExportForm::coco, {}));
  for (const char* card : {"set/README.md", "set/coco/README.md"}) {
    const std::string text = contents(card);
    ASSERT_EQ(text.substr(0, 4), "---\n") << card;
    const std::size_t end = text.find("\n---\n", 4);
    ASSERT_NE(end, std::string::npos) << card;
    const auto head = text::parse_yaml(text.substr(4, end - 4), card);
    ASSERT_TRUE(head) << head.error().text;
    text::Map root = head->root();
    EXPECT_EQ(root.required("license").text(), "cc-by-4.0");
    EXPECT_EQ(root.required("size_categories").items().at(0).text(), "n<1K");
  }
  job_.license = "Our own, \"of 2026\"";
  std::filesystem::remove_all(folder_ / "set/coco");
  ASSERT_TRUE(export_dataset(job_, folder_ / "set", ExportForm::coco, {}));
  EXPECT_THAT(contents("set/coco/README.md"), HasSubstr("license: other\nlicense_name: \"Our own, \\\"of 2026\\\"\"\n"));
}

TEST_F(ExportDataset, RefusalsHaveAReason) {
  ASSERT_TRUE(make("set"));
  EXPECT_THAT(parse_split("80,20", "").error().text, HasSubstr("three shares"));
  EXPECT_FALSE(parse_split("80,-10,30", ""));
  EXPECT_FALSE(parse_split("0,0,0", ""));
  EXPECT_THAT(parse_split("", "bed_seed,").error().text, HasSubstr("has an empty name"));
  const auto unknown = export_dataset(job_, folder_ / "set", ExportForm::coco, *parse_split("", "bed_sed"));
  EXPECT_THAT(unknown.error().text, HasSubstr("did you mean \"bed_seed\""));
  ASSERT_TRUE(export_dataset(job_, folder_ / "set", ExportForm::coco, {}));
  EXPECT_THAT(export_dataset(job_, folder_ / "set", ExportForm::coco, {}).error().text, HasSubstr("remove it to export again"));
}

TEST_F(ExportDataset, DamagedArchivesAreRefused) {
  ASSERT_TRUE(make("set"));
  const std::string whole = contents("set/shard-000000.tar");
  const auto read = [&](const std::string& bytes) {
    std::ofstream(folder_ / "damaged.tar", std::ios::binary) << bytes;
    return read_archive(folder_ / "damaged.tar", [](const std::string&, std::span<const std::byte>) { return Result<void>{}; });
  };
  ASSERT_TRUE(read(whole));
  for (const std::size_t length : {std::size_t{0}, std::size_t{100}, std::size_t{512}, whole.size() / 2, whole.size() - 1024})
    EXPECT_FALSE(read(whole.substr(0, length))) << length;
  for (const auto& [at, byte] :
       {std::pair<std::size_t, char>{0, '/'}, {0, '.'}, {124, '7'}, {130, 'x'}, {156, '2'}, {257, 'x'}}) {
    std::string changed = whole;
    changed[at] = byte;
    EXPECT_FALSE(read(changed)) << at;
  }
}

TEST_F(ExportDataset, AStoppedRunKeepsItsPingsAndCanBeContinued) {
  ASSERT_TRUE(make("whole"));
  std::atomic<bool> stop{false};
  const auto stopped = make("set", &stop, [&](const DatasetProgress& p) { stop = p.pings >= 4; });
  ASSERT_TRUE(stopped) << stopped.error().text;
  EXPECT_TRUE(stopped->stopped);
  EXPECT_EQ(stopped->set_aside, 4u);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "set/shard-000000.tar"));
  const auto done = make("set");
  ASSERT_TRUE(done) << done.error().text;
  EXPECT_EQ(done->pings, 10u) << "the other four are not made again";
  EXPECT_TRUE(done->whole);
  for (const char* name : {"shard-000000.tar", "shard-000000.json", "coco.json", "manifest.json", "contact.png", "README.md"})
    EXPECT_TRUE(contents(path("set") / name) == contents(path("whole") / name)) << name;
  EXPECT_EQ(files_in("set"), files_in("whole")) << "no file of pings that were set aside remains";
}

TEST_F(ExportDataset, PingsSetAsideThatWereDamagedAreMadeAgain) {
  ASSERT_TRUE(make("whole"));
  std::atomic<bool> stop{false};
  ASSERT_TRUE(make("set", &stop, [&](const DatasetProgress& p) { stop = p.pings >= 4; }));
  std::ofstream(folder_ / "set/shard-000000.aside", std::ios::app) << "more";
  const auto done = make("set");
  ASSERT_TRUE(done) << done.error().text;
  EXPECT_EQ(done->pings, 14u);
  EXPECT_TRUE(contents("set/shard-000000.tar") == contents("whole/shard-000000.tar"));
}

TEST(SplitsOf, SharesAreOfScenesAndEverySplitHasSome) {
  const auto counts = [](std::size_t scenes, const std::array<double, 3>& shares) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < scenes; ++i) names.push_back("scene " + std::to_string(i));
    std::array<std::size_t, 3> n{};
    for (const std::size_t split : splits_of(names, shares)) ++n.at(split);
    return n;
  };
  EXPECT_EQ(counts(100, {80, 10, 10}), (std::array<std::size_t, 3>{80, 10, 10}));
  EXPECT_EQ(counts(4, {80, 10, 10}), (std::array<std::size_t, 3>{2, 1, 1}));
  EXPECT_EQ(counts(3, {0.9, 0.05, 0.05}), (std::array<std::size_t, 3>{1, 1, 1}));
  EXPECT_EQ(counts(1, {80, 10, 10}), (std::array<std::size_t, 3>{1, 0, 0}));
  EXPECT_EQ(counts(10, {0, 1, 1}), (std::array<std::size_t, 3>{0, 5, 5}));
  EXPECT_EQ(counts(0, {80, 10, 10}), (std::array<std::size_t, 3>{0, 0, 0}));
}

}  // namespace export_dataset_test
}  // namespace sonar::dataset
