// The file of the journal of faults: lines are whole, sonard never waits for a reader or a disk, and lost lines are counted and
// reported.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "daemon/server/faults/fault_log.hpp"
#include "protocol/control/answers.hpp"
#include "tests/daemon/server/loopback.hpp"
#include "tests/small_disk.hpp"

namespace sonar::testing_daemon {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

struct Folder {
  Folder() : path(::testing::TempDir() + "journal-" + std::to_string(::getpid())) { std::filesystem::create_directory(path); }
  ~Folder() {
    std::error_code ec;
    std::filesystem::remove_all(path, ec);
  }
  std::string path;
};

std::vector<std::string> lines_of(const std::string& file) {
  std::ifstream in(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// A FIFO of the smallest size. It is read only when the test requests it.
class SlowReader {
 public:
  explicit SlowReader(const std::string& file) {
    EXPECT_EQ(::mkfifo(file.c_str(), 0600), 0);
    descriptor_ = ::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    EXPECT_GE(::fcntl(descriptor_, F_SETPIPE_SZ, 4096), 4096);
  }
  ~SlowReader() { ::close(descriptor_); }
  std::string all_there_is() const {
    std::string all(1 << 16, '\0');
    const ssize_t n = ::read(descriptor_, all.data(), all.size());
    all.resize(n < 0 ? 0 : static_cast<std::size_t>(n));
    return all;
  }

 private:
  int descriptor_ = -1;
};

TEST(JournalFile, HasWholeLinesOnADiskThatIsFull) {
  const Folder folder;
  const std::string file = folder.path + "/journal.jsonl";
  std::ofstream(file) << "from before\n";
  const auto journal = JournalFile::open(file);
  ASSERT_TRUE(journal) << journal.error().text;
  {
    const SmallDisk disk(25);  // 13 bytes are left
    const auto written = (*journal)->append("line one\nline two\nline three\n");
    EXPECT_EQ(written.lines, 1u);
    EXPECT_EQ(written.why, "File too large");
  }
  EXPECT_THAT(lines_of(file), ::testing::ElementsAre("from before", "line one"));
  EXPECT_EQ((*journal)->append("line four\n").lines, 1u);
  EXPECT_THAT(lines_of(file), ::testing::ElementsAre("from before", "line one", "line four"));
}

TEST(JournalFile, AFifoIsNotWaitedFor) {
  const Folder folder;
  const std::string file = folder.path + "/fifo";
  {
    const SlowReader reader(file);
    const auto journal = JournalFile::open(file);
    ASSERT_TRUE(journal) << journal.error().text;
    const std::string line(199, 'x');
    std::uint64_t lines = 0;
    JournalFile::Written written;
    for (; written.why.empty() && lines < 1000; lines += written.lines) written = (*journal)->append(line + "\n");
    EXPECT_EQ(written.why, "its reader is too slow");
    EXPECT_EQ(reader.all_there_is().size(), lines * 200);
    EXPECT_EQ((*journal)->append("again\n").lines, 1u);
    EXPECT_EQ(reader.all_there_is(), "again\n");
  }
  for (const auto& refused : {JournalFile::open(file).map([](const auto&) {}), JournalFile::check(file)}) {
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().text, HasSubstr("no program reads this FIFO"));
    EXPECT_EQ(refused.error().kind, ErrorKind::io);
  }
}

TEST(JournalFile, CheckGivesTheErrorsOfOpenWithoutAFile) {
  const Folder folder;
  EXPECT_TRUE(JournalFile::check(folder.path + "/new"));
  EXPECT_FALSE(std::filesystem::exists(folder.path + "/new"));
  std::filesystem::create_symlink("linked", folder.path + "/link");
  EXPECT_TRUE(JournalFile::check(folder.path + "/link")) << "the target of a link may be missing, too";
  EXPECT_FALSE(std::filesystem::exists(folder.path + "/linked"));
  EXPECT_TRUE(JournalFile::open(folder.path + "/link"));
  EXPECT_TRUE(std::filesystem::exists(folder.path + "/linked"));
  std::filesystem::create_symlink("missing/new", folder.path + "/nowhere");
  std::vector<std::string> refused = {folder.path + "/missing/new", folder.path,      folder.path + "/nowhere",
                                      "/proc/journal.jsonl",        "/sys/new.jsonl", folder.path + "/" + std::string(300, 'n')};
  for (const auto& device : std::filesystem::directory_iterator("/dev"))
    if (device.is_block_file()) refused.push_back(device.path());
  for (const std::string& wrong : refused) {
    const auto checked = JournalFile::check(wrong);
    const auto opened = JournalFile::open(wrong);
    ASSERT_FALSE(checked) << wrong;
    ASSERT_FALSE(opened) << wrong;
    EXPECT_EQ(checked.error().text, opened.error().text);
  }
}

/// A daemon with a fault in every ping, so that the journal gets a line per ping.
struct Journalled {
  explicit Journalled(const std::string& file) {
    DaemonSetup setup;
    setup.more = "faults: {armed: true, journal: " + file + ", plan: [{do: P01, at: {every: 1}}]}\n";
    daemon.emplace(setup);
    client.emplace(daemon->address());
    client->fire(fire_at(oculus::PingRate::hz40));
  }
  /// Receives pings until entries of the journal are lost. Returns false if none is lost within the time limit.
  bool loses() {
    const auto deadline = Steady::now() + patience;
    while (daemon->status().notes_size() == 0 && Steady::now() < deadline)
      if (!client->next_ping()) return false;
    return daemon->status().notes_size() > 0;
  }
  std::string metrics() {
    std::string text;
    daemon->on_io_thread([&] { text = daemon->app().operations().metrics(); });
    return text;
  }
  std::optional<Daemon> daemon;
  std::optional<Client> client;
};

TEST(FaultJournal, DelaysNoPingAndCountsTheEntriesThatASlowReaderLoses) {
  const Folder folder;
  const std::string file = folder.path + "/fifo";
  const SlowReader reader(file);
  Journalled it(file);
  ASSERT_TRUE(it.loses());
  EXPECT_THAT(it.daemon->status().notes(0).text(),
              HasSubstr("entries of the journal of faults " + file + " are lost: its reader"));
  EXPECT_THAT(it.metrics(), Not(HasSubstr("sonard_fault_entries_lost_total 0\n")));
  EXPECT_THAT(it.daemon->log_text(), HasSubstr("entries of the journal of faults are lost: its reader is too slow"));
  EXPECT_TRUE(reader.all_there_is().ends_with("}\n"));
  const auto is_written_again = [&] {
    return it.client->next_ping() && it.daemon->log_text().find("written again") != std::string::npos;
  };
  EXPECT_TRUE(eventually(is_written_again)) << it.daemon->log_text();
  EXPECT_EQ(it.daemon->stop(), 0);
}

TEST(FaultJournal, ReportsAFullDisk) {
  Journalled it("/dev/full");
  ASSERT_TRUE(it.loses());
  EXPECT_THAT(it.daemon->status().notes(0).text(), HasSubstr("are lost: No space left on device"));
  EXPECT_THAT(it.daemon->log_text(), HasSubstr("journal of faults are lost: No space left on device"));
  EXPECT_TRUE(it.client->next_ping());
  EXPECT_EQ(it.daemon->stop(), 0);
}

TEST(FaultJournal, HasTheLastEntriesWhenTheDaemonStops) {
  const Folder folder;
  const std::string file = folder.path + "/journal.jsonl";
  Journalled it(file);
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(it.client->next_ping());
  const auto report = it.daemon->ask(control::GetFaults{}).faults;
  EXPECT_EQ(it.daemon->stop(), 0);
  const auto lines = lines_of(file);
  ASSERT_GE(lines.size(), static_cast<std::size_t>(report->journal_size()));
  for (const std::string& line : lines) EXPECT_TRUE(line.starts_with('{') && line.ends_with('}')) << line;
}

}  // namespace
}  // namespace sonar::testing_daemon
