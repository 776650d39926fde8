// What travels to workers, without a server.
#include "daemon/commands/farm/farm_job.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <map>

#include "core/base/confined_reads.hpp"
#include "core/base/regular_file.hpp"

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
  Result<std::vector<std::string>> keys(Table) override { return {}; }
  Result<void> erase(Table, const std::string&) override { return {}; }
  Result<void> open_job(const std::string&, std::chrono::milliseconds) override { return {}; }
  Result<bool> publish(const std::string&, std::uint64_t) override { return true; }
  Result<Waiting> waiting(const std::string&) override { return Waiting{}; }
  Result<std::unique_ptr<Task>> take(const std::string&, std::chrono::milliseconds) override { return std::unique_ptr<Task>(); }
  std::map<std::string, std::string> all;
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

TEST_F(FarmJobTest, IdIsOfAllContents) {
  const FarmJob a = record();
  EXPECT_EQ(a.id.size(), 64u);
  EXPECT_EQ(a.folder(), "set-" + a.id.substr(0, 12));
  EXPECT_EQ(a.shards, 3u);
  EXPECT_EQ(parse_farm_job(a.id, a.to_json()).value().to_json(), a.to_json());
  EXPECT_NE(describe(job(), "avx2").value().id, a.id);
  put("job/meshes/a.stl", "b");
  EXPECT_NE(record().id, a.id);
  EXPECT_THAT(parse_farm_job(a.id, record().to_json()).error().text, HasSubstr("does not fit its id"));
  EXPECT_THAT(parse_farm_job(a.id, "{}").error().text, HasSubstr("cannot be read"));
}

TEST_F(FarmJobTest, FilesArriveAsTheyWere) {
  TableInMemory queue;
  FarmJob sent = record();
  ASSERT_TRUE(send_files(job(), sent, folder_ / "shared", queue));
  EXPECT_TRUE(sent.in_bucket);
  EXPECT_EQ(queue.all.size(), 3u);  // the mesh in two pieces
  const auto file = receive_files(sent, folder_ / "own", queue);
  ASSERT_TRUE(file) << file.error().text;
  EXPECT_EQ(describe(dataset::load_job(*file).value(), "portable").value().id, sent.id);
  queue.all.clear();
  EXPECT_TRUE(receive_files(sent, folder_ / "shared", queue));
  EXPECT_THAT(receive_files(sent, folder_ / "none", queue).error().text, HasSubstr("submit the job again"));
  sent.in_bucket = false;
  EXPECT_THAT(receive_files(sent, folder_ / "none", queue).error().text, HasSubstr("8 MiB"));
}

TEST_F(FarmJobTest, NothingLeadsOutOfTheFolder) {
  put("job/set.yaml", "dataset: {pings: 5}\nscene: {objects: [{type: mesh, file: ../else.stl}]}\n");
  put("else.stl", "x");
  EXPECT_THAT(describe(job(), "portable").error().text, HasSubstr("../else.stl is not below"));
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

TEST_F(FarmJobTest, OthersMakeOtherBytes) {
  FarmJob is = record();
  EXPECT_EQ(why_unfit(is), "");
  is.instruction_set = "avx1024";
  EXPECT_THAT(why_unfit(is), HasSubstr("which this processor lacks"));
  is.version = "9.9.9";
  EXPECT_THAT(why_unfit(is), HasSubstr("was submitted by sonard 9.9.9"));
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
