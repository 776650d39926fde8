// A small data set is made at once, in parts, with more threads, and after an interruption. Wrong data sets are refused.
#include "daemon/commands/dataset/make_dataset.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "daemon/commands/dataset/shards.hpp"

namespace sonar::dataset {
namespace {

using nlohmann::json;
using std::filesystem::path;
using testing::HasSubstr;

const std::string small = R"(
about: a ball before a plane
dataset: {pings: 10, shard: 4, seed: 5, negatives: 0.3, targets: [ball], license: CC0-1.0}
vary: {x: {uniform: [3, 6]}, y: {uniform: [-3, 3]}, stones: {integer: [0, 2]}, gain: {choice: [0, 6]}}
counts: {stone: $stones}
constraints: {in_view: [ball], no_overlap: [ball, stone], above_bed: [sonar, ball], bed: bed}
scene:
  materials: {bed_sand: {like: sand, label: seabed}}
  objects:
    - {name: bed, type: plane, material: bed_sand, size_m: [20, 20], patch_m: 5, pose: {xyz_m: [5, 0, -12]}}
    - {name: ball, label: ball, type: sphere, material: steel, radius_m: 0.3, segments: 24, pose: {xyz_m: [$x, $y, -11.7]}}
    - {name: stone, label: stone, type: box, material: rock, size_m: [0.4, 0.4, 0.4], instances: [{xyz_m: [4, 1, -11.8]}, {xyz_m: [5, -1, -11.8]}]}
sonar: {ping: {range_m: 7, beams: 32, rows: 64, gain_db: $gain}}
poses: {at: {frame: ENU_FLU, xyz_m: [0, 0, -10.5], rpy_deg: [0, 15, 0]}}
)";

class MakeDataset : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("dataset_test." + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Result<DatasetProgress> make(const std::string& out, const DatasetOptions& options = {}, const std::string& text = small) {
    const auto job = parse_job(text, "small.yaml", folder_);
    if (!job) return tl::make_unexpected(job.error());
    DatasetOptions o = options;
    o.out = folder_ / out;
    return make_dataset(*job, o, [](const DatasetProgress&) {});
  }
  std::string complaint(const std::string& text) {
    const auto made = make("refused" + std::to_string(++refused_), {}, text);
    return made ? "" : made.error().text;
  }
  std::string contents(const path& file) const {
    std::ifstream in(folder_ / file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static std::string with(const std::string& from, const std::string& to) {
    std::string text = small;
    return text.replace(text.find(from), from.size(), to);
  }

  path folder_;
  int refused_ = 0;
};

TEST_F(MakeDataset, WritesShardsLabelsAndACard) {
  const auto made = make("a");
  ASSERT_TRUE(made) << made.error().text;
  EXPECT_TRUE(made->whole);
  EXPECT_EQ(made->pings, 10u);
  const json manifest = json::parse(contents("a/manifest.json")), coco = json::parse(contents("a/coco.json"));
  ASSERT_EQ(manifest["shards"].size(), 3u);
  EXPECT_EQ(manifest["shards"][2]["pings"], 2);
  EXPECT_EQ(manifest["shards"][1]["sha256"], *digest_of_file(folder_ / "a/shard-000001.tar"));
  EXPECT_EQ(coco["images"].size(), 10u);
  std::set<std::string> classes;
  for (const json& c : coco["categories"]) classes.insert(c["name"]);
  EXPECT_TRUE(classes.contains("ball"));
  const std::string tar = contents("a/shard-000000.tar");
  EXPECT_EQ(tar.substr(0, 22), "0000000001.samples.png");
  EXPECT_EQ(tar.substr(257, 5), "ustar");
  EXPECT_EQ(tar.size() % 512, 0u);
  EXPECT_THAT(contents("a/README.md"), HasSubstr("CC0-1.0"));
  EXPECT_GT(contents("a/contact.png").size(), 1000u);
  for (const json& a : coco["annotations"]) {
    EXPECT_GT(a["area"], 0);
    EXPECT_EQ(a["bbox"].size(), 4u);
    EXPECT_GE(a["segmentation"][0].size(), 8u);
    EXPECT_GE(a["cartesian"]["segmentation"][0].size(), 8u);
  }
}

TEST_F(MakeDataset, ThreadsAndPartsMakeTheSameBytes) {
  ASSERT_TRUE(make("one"));
  ASSERT_TRUE(make("two", {.out = {}, .threads = 2}));
  EXPECT_EQ(contents("one/manifest.json"), contents("two/manifest.json"));
  EXPECT_EQ(contents("one/coco.json"), contents("two/coco.json"));
  const auto first = make("parts", {.out = {}, .part = 1, .parts = 2});
  ASSERT_TRUE(first);
  EXPECT_FALSE(first->whole);
  EXPECT_EQ(first->shards, 1u);
  const auto second = make("parts", {.out = {}, .part = 0, .parts = 2});
  ASSERT_TRUE(second);
  EXPECT_TRUE(second->whole);
  EXPECT_EQ(contents("one/manifest.json"), contents("parts/manifest.json"));
}

TEST_F(MakeDataset, ContinuesAfterAnInterruption) {
  ASSERT_TRUE(make("a"));
  const std::string manifest = contents("a/manifest.json");
  std::filesystem::remove(folder_ / "a/shard-000001.tar");         // as if it had never been written
  std::filesystem::remove(folder_ / "a/shard-000002.tar.sha256");  // as if killed before the digest
  const path half = folder_ / "a/shard-000001.tar.tmp.elsewhere.1", of_the_user = folder_ / "a/notes.tmp";
  std::ofstream(half) << "half a shard";
  std::ofstream(of_the_user) << "mine";
  const auto again = make("a");
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_EQ(again->kept_shards, 2u);
  EXPECT_EQ(again->pings, 4u);
  EXPECT_EQ(contents("a/manifest.json"), manifest);
  EXPECT_FALSE(std::filesystem::exists(half));
  EXPECT_TRUE(std::filesystem::exists(of_the_user));
}

TEST_F(MakeDataset, TwoWritersOfOneFileDoNotDisturbEachOther) {
  const std::vector<std::byte> one(700, std::byte{1}), two(2000, std::byte{2});
  auto a = ShardWriter::open(folder_ / "s.tar"), b = ShardWriter::open(folder_ / "s.tar");
  ASSERT_TRUE(a && b);
  ASSERT_TRUE(a->add("one", one));
  ASSERT_TRUE(b->add("two", two));
  remove_unfinished(folder_, [](const std::string&) { return true; });  // removes neither: both belong to a live run
  ASSERT_TRUE(a->commit());
  EXPECT_EQ(contents("s.tar").size(), 512u + 1024 + 1024);
  const auto other = b->commit();
  ASSERT_FALSE(other);  // the first file stays
  EXPECT_EQ(other.error().kind, ErrorKind::bad_data);
  EXPECT_THAT(other.error().text, HasSubstr("other bytes"));
  auto equal = ShardWriter::open(folder_ / "s.tar");
  ASSERT_TRUE(equal && equal->add("one", one));
  const auto digest = equal->commit();
  ASSERT_TRUE(digest) << digest.error().text;
  EXPECT_EQ(*digest, *digest_of_file(folder_ / "s.tar"));
  auto c = DurableFile::open(folder_ / "job.json"), d = DurableFile::open(folder_ / "job.json");
  ASSERT_TRUE(c && d && c->write("first") && d->write("second"));
  EXPECT_TRUE(c->commit_new().value());
  EXPECT_FALSE(d->commit_new().value());
  EXPECT_EQ(contents("job.json"), "first");
}

TEST_F(MakeDataset, KeepsFilesOfTheUser) {
  for (const char* name : {"README.md", "manifest.json", "coco.json", "contact.png", "shard-000007.tar"}) {
    const path out = folder_ / "mine" / name;
    std::filesystem::create_directories(out.parent_path());
    std::ofstream(out) << "mine";
    const auto made = make("mine");
    ASSERT_FALSE(made) << name;
    EXPECT_EQ(made.error().kind, ErrorKind::usage);
    EXPECT_THAT(made.error().text, HasSubstr(out.string()));
    EXPECT_EQ(contents(path("mine") / name), "mine");
    std::filesystem::remove_all(out.parent_path());
  }
}

TEST_F(MakeDataset, IsNotWholeWithoutAnArchiveOfAnotherPart) {
  ASSERT_TRUE(make("a", {.out = {}, .part = 1, .parts = 2}));
  std::filesystem::remove(folder_ / "a/shard-000001.tar");  // its digest stays
  const auto made = make("a", {.out = {}, .part = 0, .parts = 2});
  ASSERT_TRUE(made) << made.error().text;
  EXPECT_FALSE(made->whole);
  EXPECT_EQ(made->missing, 1u);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a/manifest.json"));
}

TEST_F(MakeDataset, OneBeamHasNoContactSheet) {
  const auto made = make("a", {}, with("beams: 32", "beams: 1"));
  ASSERT_TRUE(made) << made.error().text;
  EXPECT_TRUE(made->whole);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a/contact.png"));
  EXPECT_THAT(contents("a/README.md"), testing::Not(HasSubstr("contact.png")));
}

TEST_F(MakeDataset, CountsMayBeFormulasOrNamesOfLet) {
  for (const char* count : {"$(2 * stones)", "$twice"}) {
    const auto job =
        parse_job(with("counts: {stone: $stones}", std::string("let: {twice: 2 * stones}\ncounts: {stone: ") + count + "}"),
                  "small.yaml", folder_);
    ASSERT_TRUE(job) << job.error().text;
    const auto ping = draw_ping(*job, 1);
    ASSERT_TRUE(ping) << ping.error().text;
    int kept = 0;
    for (const Object& o : ping->job.scene->objects) kept += o.label == "stone" && o.visible ? 1 : 0;
    EXPECT_EQ(kept, std::min(2.0, 2 * ping->draws.numbers.at("stones")));
  }
}

TEST_F(MakeDataset, ACountSelectsObjectsAtRandom) {
  const auto job = parse_job(with("counts: {stone: $stones}", "counts: {stone: 1}"), "small.yaml", folder_);
  ASSERT_TRUE(job) << job.error().text;
  std::set<std::size_t> stayed;
  for (std::uint64_t number = 1; number <= 10; ++number) {
    const auto ping = draw_ping(*job, number);
    ASSERT_TRUE(ping) << ping.error().text;
    const auto& objects = ping->job.scene->objects;
    for (std::size_t i = 0; i < objects.size(); ++i)
      if (objects[i].label == "stone" && objects[i].visible) stayed.insert(i);
  }
  EXPECT_EQ(stayed.size(), 2U) << "each of the two stones is in some pings";
}

TEST_F(MakeDataset, LineEndsOfWindowsChangeNoPing) {
  std::string text = with("  objects:", "\n  objects:");  // a blank line within the scene
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2) text.insert(at, "\r");
  const auto lf = parse_job(small, "small.yaml", folder_), crlf = parse_job(text, "small.yaml", folder_);
  ASSERT_TRUE(lf && crlf) << crlf.error().text;
  const auto first = draw_ping(*crlf, 1), second = draw_ping(*crlf, 2, {first->scene_key, first->whole_scene});
  ASSERT_TRUE(first && second) << second.error().text;
  EXPECT_NE(first->scene_key, second->scene_key);
  EXPECT_EQ(second->job.scene->objects[1].in_world.position_m.x, draw_ping(*lf, 2)->job.scene->objects[1].in_world.position_m.x);
}

TEST_F(MakeDataset, AJobInFlowStyleIsTheSame) {
  const auto job = parse_job(
      "# in one pair of braces\n{dataset: {pings: 4}, vary: {x: {uniform: [3, 6]}},\n"
      "scene: {objects: [{name: ball, type: sphere, material: steel, radius_m: 0.3, pose: {xyz_m: [$(2 * x), 0, -11]}}]},\n"
      "sonar: {ping: {range_m: 7, beams: 8, rows: 16}}, poses: {at: {frame: ENU_FLU, xyz_m: [0, 0, -10.5]}}}  # } the end\n",
      "flow.yaml", folder_);
  ASSERT_TRUE(job) << job.error().text;
  for (const std::uint64_t number : {1u, 2u}) {
    const auto ping = draw_ping(*job, number);
    ASSERT_TRUE(ping) << ping.error().text;
    EXPECT_NEAR(ping->job.scene->objects[0].in_world.position_m.x, 2 * ping->draws.numbers.at("x"), 1e-9);
  }
}

TEST_F(MakeDataset, FilesThatOtherPingsDrawCountAsInputs) {
  for (const char* name : {"a.yaml", "b.yaml"})
    std::ofstream(folder_ / name) << "objects:\n  - {name: ball, type: sphere, material: steel, radius_m: 0.3, segments: 24, "
                                     "label: ball, pose: {xyz_m: [4, 0, -11.7]}}\n";
  const std::string text =
      "dataset: {pings: 1}\nvary: {which: {list: [a, b]}}\nscene: $which.yaml\n"
      "sonar: {ping: {range_m: 7, beams: 8, rows: 16}}\nposes: {at: {frame: ENU_FLU, xyz_m: [0, 0, -10.5]}}\n";
  ASSERT_TRUE(make("a", {}, text));
  ASSERT_TRUE(make("a", {}, text));
  std::ofstream(folder_ / "b.yaml", std::ios::app) << "# changed\n";
  const auto again = make("a", {}, text);
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().text, HasSubstr("another job"));
}

TEST_F(MakeDataset, RefusesAShardThatDiffers) {
  ASSERT_TRUE(make("a"));
  std::ofstream(folder_ / "a/shard-000001.tar", std::ios::app) << "more";
  const auto again = make("a");
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().text, HasSubstr("shard-000001.tar differs from"));
  const auto other = make("a", {}, with("seed: 5", "seed: 6"));
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().text, HasSubstr("holds shards of another job"));
}

TEST_F(MakeDataset, ErrorsInAJobHaveAReason) {
  EXPECT_THAT(complaint(with("shard: 4", "shrad: 4")), HasSubstr("shrad"));
  EXPECT_THAT(complaint(with("in_view: [ball]", "in_view: [bull]")),
              HasSubstr("no object or label \"bull\"; did you mean \"ball\""));
  EXPECT_THAT(complaint(with("uniform: [3, 6]", "uniform: [30, 60]")), HasSubstr("in_view failed 100 times"));
  EXPECT_THAT(complaint(with(", targets: [ball]", "")), HasSubstr("needs targets"));
  EXPECT_THAT(complaint(with("$y, -11.7", "$z, -11.7")), HasSubstr("unknown name z"));
  EXPECT_THAT(complaint(with("counts: {stone", "counts: {stoun")), HasSubstr("no object of that name or label"));
  EXPECT_THAT(complaint(with("gain_db: $gain", "gain_db: $gain, bits: 32")), HasSubstr("do not fit a PNG"));
  EXPECT_THAT(complaint(with("beams: 32, rows: 64, gain_db: $gain}", "gain_db: $gain}, profile: waterlinked-3d15")),
              HasSubstr("range images have no labels"));
  EXPECT_THAT(complaint(with(", bed: bed", "")), HasSubstr("needs bed"));
}

TEST_F(MakeDataset, RefusesAFolderThatCannotBeMade) {
  std::ofstream(folder_ / "file") << "x";
  const auto made = make("file/out");
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().kind, ErrorKind::io);
}

}  // namespace
}  // namespace sonar::dataset
