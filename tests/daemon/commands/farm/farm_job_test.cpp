// Tests, without a server, the records and files that are sent to workers.
#include "daemon/commands/farm/farm_job.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "core/base/regular_file.hpp"
#include "core/pipeline/simd/kernels.hpp"
#include "core/text/format.hpp"
#include "daemon/commands/farm/queue.hpp"
#include "daemon/commands/options/commands.hpp"

namespace sonar::farm {
namespace {

using std::filesystem::path;
using testing::HasSubstr;

class TableInMemory final : public Queue {
 public:
  Result<void> put(Table table, const std::string& key, std::string_view value) override {
    all[table.name + ("/" + key)] = value;
    return {};
  }
  Result<std::optional<std::string>> get(Table table, const std::string& key) override {
    const auto at = all.find(table.name + ("/" + key));
    return at == all.end() ? std::nullopt : std::optional(at->second);
  }
  Result<std::vector<std::string>> keys(Table table) override {
    std::vector<std::string> found;
    const std::string begin = table.name + std::string("/");
    for (const auto& [key, value] : all)
      if (key.starts_with(begin)) found.push_back(key.substr(begin.size()));
    return found;
  }
  Result<void> erase(Table, const std::string&) override { return {}; }
  Result<void> open_job(const std::string&, std::chrono::milliseconds) override { return {}; }
  Result<bool> publish(const std::string&, std::uint64_t) override { return true; }
  Result<Waiting> waiting(const std::string&) override { return Waiting{shards.size(), 0}; }
  Result<std::unique_ptr<Task>> take(const std::string&, std::chrono::milliseconds) override {
    if (shards.empty()) return std::unique_ptr<Task>();
    return std::make_unique<TaskInMemory>(*this, shards.front());
  }
  std::map<std::string, std::string> all;
  std::vector<std::uint64_t> shards;
  std::vector<std::string> ends;  // ends of tasks

 private:
  class TaskInMemory final : public Task {
   public:
    TaskInMemory(TableInMemory& queue, std::uint64_t shard) : queue_(queue), shard_(shard) {}
    std::uint64_t shard() const override { return shard_; }
    int delivery() const override { return 1; }
    Result<void> in_progress() override { return {}; }
    Result<void> done() override { return end("done"); }
    Result<void> again(std::chrono::milliseconds) override { return end("again"); }
    Result<void> bury(const std::string&) override { return end("bury"); }
    Result<void> drop() override { return end("drop"); }

   private:
    Result<void> end(const std::string& how) {
      queue_.ends.push_back(std::to_string(shard_) + " " + how);
      std::erase(queue_.shards, shard_);
      return {};
    }
    TableInMemory& queue_;
    std::uint64_t shard_;
  };
};

class FarmJobTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("farm_job_test." + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_ / "job/meshes");
    put("job/set.yaml", "dataset: {pings: 5, shard: 2}\nscene: {objects: [{type: mesh, file: meshes/a.stl}]}\n");
    put("job/meshes/a.stl", std::string(700'000, 'a'));
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void put(const path& file, const std::string& text) { std::ofstream(folder_ / file) << text; }
  dataset::DatasetJob job() { return dataset::load_job(folder_ / "job/set.yaml").value(); }
  FarmJob record() { return describe(job(), "portable").value(); }

  path folder_;
};

TEST_F(FarmJobTest, TheIdDependsOnAllContents) {
  const FarmJob a = record();
  EXPECT_EQ(a.id.size(), 64u);
  EXPECT_EQ(a.folder(), "set-" + a.id.substr(0, 12));
  EXPECT_EQ(a.shards, 3u);
  EXPECT_EQ(parse_farm_job(a.id, a.to_json()).value().to_json(), a.to_json());
  EXPECT_NE(describe(job(), "avx2").value().id, a.id);
  put("job/meshes/a.stl", "b");
  EXPECT_NE(record().id, a.id);
  EXPECT_THAT(parse_farm_job(a.id, record().to_json()).error().text, HasSubstr("does not match its id"));
  EXPECT_THAT(parse_farm_job(a.id, "{}").error().text, HasSubstr("cannot be read"));
}

TEST_F(FarmJobTest, FilesArriveAsTheyWere) {
  TableInMemory queue;
  FarmJob sent = record();
  ASSERT_TRUE(send_files(job(), sent, folder_ / "shared", queue));
  EXPECT_TRUE(sent.in_bucket);
  EXPECT_EQ(queue.all.size(), 3u);  // the job file, and the mesh in two pieces
  const auto file = receive_files(sent, folder_ / "own", queue);
  ASSERT_TRUE(file) << file.error().text;
  EXPECT_EQ(describe(dataset::load_job(*file).value(), "portable").value().id, sent.id);
  queue.all.clear();
  EXPECT_TRUE(receive_files(sent, folder_ / "shared", queue));
  EXPECT_THAT(receive_files(sent, folder_ / "none", queue).error().text, HasSubstr("submit the job again"));
  sent.in_bucket = false;
  EXPECT_THAT(receive_files(sent, folder_ / "none", queue).error().text, HasSubstr("8 MiB"));
}

TEST_F(FarmJobTest, FilesOutsideTheFolderAreRefused) {
  put("job/set.yaml", "dataset: {pings: 5}\nscene: {objects: [{type: mesh, file: ../else.stl}]}\n");
  put("else.stl", "x");
  EXPECT_THAT(describe(job(), "portable").error().text, HasSubstr("../else.stl is outside the job's folder"));
  put("job/set.yaml", "dataset: {pings: 5}\n");
  for (const char* name : {"../else.stl", "/etc/else", "a/../../b", "", "a/"}) {
    TableInMemory queue;
    FarmJob bad = record();
    bad.files.push_back({name, bad.files[0].digest});
    const auto parsed = parse_farm_job(bad.id, bad.to_json());
    ASSERT_FALSE(parsed) << name;
    EXPECT_THAT(parsed.error().text, HasSubstr("lead out of")) << name;
  }
  TableInMemory queue;
  put("job/set.yaml", "dataset: {pings: 5}\nscene: {objects: [{type: mesh, file: meshes/a.stl}]}\n");
  FarmJob sent = record();
  ASSERT_TRUE(send_files(job(), sent, folder_ / "shared", queue));
  std::filesystem::create_directories(folder_ / "linked");
  std::filesystem::create_directory_symlink(folder_ / "job", folder_ / "linked/meshes");
  std::filesystem::remove(folder_ / "job/meshes/a.stl");
  EXPECT_THAT(receive_files(sent, folder_ / "linked", queue).error().text, HasSubstr("by a link"));
}

TEST_F(FarmJobTest, ImpossibleCountsAreRefused) {
  const FarmJob is = record();
  using nlohmann::json;
  const std::vector<std::pair<const char*, json>> wrong{
      {"shards", -1},        {"shards", 1e18},    {"shards", 0},       {"shards", 4},
      {"shards", "3"},       {"shards", 3.0},     {"pings", 0},        {"pings", 1e300},
      {"pings", -5},         {"shard_pings", 0},  {"shard_pings", -2}, {"shards", false},
      {"patience_ms", 1e18}, {"patience_ms", -1}, {"patience_ms", 99}, {"shards", 18446744073709551615u}};
  for (const auto& [key, value] : wrong) {
    json words = json::parse(is.to_json());
    words[key] = value;
    const auto parsed = parse_farm_job(is.id, words.dump());
    ASSERT_FALSE(parsed) << key << ' ' << value;
    EXPECT_THAT(parsed.error().text, HasSubstr(std::string("is invalid: ") + key + " is ")) << value;
  }
  json words = json::parse(is.to_json());  // consistent in itself, but not with the job file
  words["shards"] = 5, words["shard_pings"] = 1;
  const auto parsed = parse_farm_job(is.id, words.dump());
  ASSERT_TRUE(parsed) << parsed.error().text;
  EXPECT_THAT(
      load_files(*parsed, folder_ / "job/set.yaml").error().text,
      HasSubstr("its file set.yaml: the record has 5 shards for 5 pings, up to 1 in each, the file has 3 shards for 5 pings, "
                "up to 2 in each; "));
  EXPECT_TRUE(load_files(is, folder_ / "job/set.yaml"));
}

/// Runs in a separate process and restricts which files it can read. Returns the number of the failed check; 0 = none.
int work_on_foreign_shards(const path& folder) {
  TableInMemory queue;
  const auto job = dataset::load_job(folder / "job/set.yaml").value();
  FarmJob sent = describe(job, simd::kernels_for(SimdLevel::automatic).name).value();
  if (!send_files(job, sent, folder / "shared", queue) || !queue.put(job_table, sent.id, sent.to_json())) return 1;
  queue.shards = {3, 999999999, 18446744073709551615u};
  WorkerCommand command;
  command.out = folder / "out", command.threads = 1, command.until_empty = true;
  const auto code = work_on(queue, command);
  if (!code || *code != 0) return 2;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "out"))
    if (entry.path().filename().string().starts_with("shard-")) return 3;
  return queue.ends == std::vector<std::string>{"3 drop", "999999999 drop", "18446744073709551615 drop"} ? 0 : 4;
}

TEST_F(FarmJobTest, AWorkerDropsTasksOfShardsThatTheJobLacks) {
  put("job/set.yaml",
      "dataset: {pings: 5, shard: 2}\n"
      "scene: {objects: [{name: bed, type: plane, material: sand, size_m: [20, 20], pose: {xyz_m: [5, 0, -12]}}]}\n"
      "sonar: {ping: {range_m: 7, beams: 32, rows: 64}}\n"
      "poses: {at: {frame: ENU_FLU, xyz_m: [0, 0, -10.5], rpy_deg: [0, 10, 0]}}\n");
  EXPECT_EXIT(std::_Exit(work_on_foreign_shards(folder_)), testing::ExitedWithCode(0),
              "shard 999999999 is not one of the 3 of set-");
}

TEST_F(FarmJobTest, TheStatusShowsNoRawBytesOfTheQueue) {
  TableInMemory queue;
  const FarmJob is = record();
  ASSERT_TRUE(queue.put(job_table, is.id, is.to_json()));
  ASSERT_TRUE(queue.put(job_table, "odd", "\xff\x1b[2J"));
  ASSERT_TRUE(queue.put(job_table, is.id + ".stopped", "why\n\x1b]0;title\x07"));
  ASSERT_TRUE(queue.put(dead_table, is.id + ".2", "\xff not met"));
  ASSERT_TRUE(queue.put(dead_table, is.id + ".99", "none of the job's"));
  ASSERT_TRUE(queue.put(beat_table, "host\x1b[31m.7",
                        R"({"job":")" + is.id + R"(","shard":"\u001b[1m","shards":-1,"pings_per_s":1e300})"));
  ASSERT_TRUE(queue.put(beat_table, "other.8", R"({"job":5,"shard":[]})"));
  ASSERT_TRUE(queue.put(beat_table, "third.9", R"({"job":")" + is.id + R"(","shard":7,"shards":"x","pings_per_s":-3})"));
  const auto text = describe_farm(queue);
  ASSERT_TRUE(text) << text.error().text;
  EXPECT_THAT(*text, HasSubstr(R"(STOPPED: why\x0a\x1b]0;title\x07)"));
  EXPECT_THAT(*text, HasSubstr(R"(dead: shard 2: \xff not met)"));
  EXPECT_THAT(*text, HasSubstr("2 done, 0 running, 0 queued, 1 dead"));
  EXPECT_THAT(*text, HasSubstr("third.9: , 0.0 pings/s, 0 shards made"));
  EXPECT_THAT(*text, testing::Not(HasSubstr("other.8")));
  EXPECT_EQ(text::printable(*text).size() - text->size(),
            3 * static_cast<std::size_t>(std::count(text->begin(), text->end(), '\n')))
      << *text;  // only line ends have to be escaped
}

TEST_F(FarmJobTest, AnotherVersionOrInstructionSetIsUnfit) {
  FarmJob is = record();
  EXPECT_EQ(why_unfit(is), "");
  is.instruction_set = "avx1024";
  EXPECT_THAT(why_unfit(is), HasSubstr("which this processor lacks"));
  is.version = "9.9.9";
  EXPECT_THAT(why_unfit(is), HasSubstr("was submitted with sonard 9.9.9"));
}

TEST_F(FarmJobTest, AWorkerReadsNothingElse) {
  put("secret", "x");
  EXPECT_EXIT(
      {
        confine_reads(folder_ / "job");
        std::filesystem::create_symlink("../secret", folder_ / "job/link");
        const auto is_refused = [&](const path& name) {
          const auto read = read_regular(folder_ / name, 10);
          return !read && read.error().text.find("is outside of") != std::string::npos;
        };
        const bool ok = is_refused("secret") && is_refused("job/../secret") && is_refused("job/link") &&
                        read_regular(folder_ / "job/set.yaml", 1000).has_value();
        std::_Exit(ok ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace sonar::farm
