// Recordings inside the daemon: their names, the content of files, and that neither a full nor a slow disk affects clients.
#include <gmock/gmock.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "daemon/server/recording/recordings.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/recording/recording.hpp"
#include "tests/daemon/server/loopback.hpp"
#include "tests/small_disk.hpp"

namespace sonar::testing_daemon::recordings_test {
namespace {

using oculus::PingRate;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A folder of this test; the destructor removes it.
struct Folder {
  Folder() {
    static int count = 0;
    path = ::testing::TempDir() + "recordings-" + std::to_string(::getpid()) + "-" + std::to_string(++count);
    std::filesystem::create_directory(path);
  }
  ~Folder() {
    std::error_code ec;
    std::filesystem::remove_all(path, ec);
  }
  std::string path;
};

std::uint64_t messages_in(const std::filesystem::path& file) {
  const auto opened = recording::open_recording(file);
  if (!opened) {
    ADD_FAILURE() << opened.error().text;
    return 0;
  }
  std::uint64_t count = 0;
  while (const auto message = opened->reader->next()) count += message->by == recording::Carrier::stream ? 1 : 0;
  EXPECT_FALSE(opened->reader->damage()) << file;
  return count;
}

// ---- names and files

TEST(RecordingName, HasAKnownExtensionAndNoFolder) {
  EXPECT_EQ(*RecordingFile::kind_of("run-1.mcap", "oculus"), &RecordingFile::mcap);
  EXPECT_EQ(*RecordingFile::kind_of("Run_2.a.pcap", "oculus"), &RecordingFile::pcap);
  EXPECT_EQ((*RecordingFile::kind_of("r.oculus", "oculus"))->ending, ".oculus");
  EXPECT_EQ(*RecordingFile::kind_of("r.raw", "oculus"), &RecordingFile::raw_dump);
  EXPECT_EQ(*RecordingFile::kind_of("head.mcap", "blueview"), &RecordingFile::mcap);
  EXPECT_EQ((*RecordingFile::kind_of("a.aris", "aris"))->ending, ".aris");
  EXPECT_EQ((*RecordingFile::kind_of("a.sonar", "waterlinked"))->ending, ".sonar");
  EXPECT_THAT(RecordingFile::kind_of("a.sonar", "oculus").error().text, HasSubstr("images of a Sonar 3D-15"));
  EXPECT_EQ((*RecordingFile::kind_of("a.svlog", "surveyor240"))->ending, ".svlog");
  EXPECT_EQ((*RecordingFile::kind_of("a.svlog", "omniscan450"))->ending, ".svlog");
  EXPECT_THAT(RecordingFile::kind_of("a.svlog", "aris").error().text, HasSubstr("frames of a Surveyor"));
  EXPECT_THAT(RecordingFile::kind_of("a.aris", "oculus").error().text, HasSubstr("frames of an ARIS"));
  EXPECT_THAT(RecordingFile::kind_of("a.raw", "aris").error().text, HasSubstr("pings that are one stream"));
  EXPECT_THAT(RecordingFile::kind_of("head.pcap", "blueview").error().text, HasSubstr("end the name in .mcap"));
  const std::string longest = std::string(123, 'a') + ".mcap";
  EXPECT_TRUE(RecordingFile::kind_of(longest, "oculus"));
  for (const std::string& name : {std::string(), std::string("../run.mcap"), std::string("a/run.mcap"), std::string("/run.mcap"),
                                  std::string(".mcap"), std::string("..mcap"), std::string("a b.mcap"), std::string("a\\b.mcap"),
                                  std::string("run\0.mcap", 9), std::string("r\xc3\xbc.mcap"), "a" + longest})
    EXPECT_THAT(RecordingFile::kind_of(name, "oculus").error().text, HasSubstr("no folder")) << name;
  for (const char* name : {"-run.mcap", "-.raw", "--overwrite.pcap", "-"})
    EXPECT_THAT(RecordingFile::kind_of(name, "oculus").error().text, HasSubstr("must not begin with -")) << name;
  for (const char* name : {"run", "run.txt", "mcap", "run.mcap.gz"})
    EXPECT_THAT(RecordingFile::kind_of(name, "oculus").error().text, HasSubstr("by its end")) << name;
}

/// Returns a message of an Oculus with this number of bytes, at most 271: the header, and a payload of ones.
protocol::Bytes oculus_message(std::size_t bytes) {
  protocol::Bytes message(bytes, std::byte{1});
  std::fill_n(message.begin(), 16, std::byte{0});
  message[0] = std::byte{'S'}, message[1] = std::byte{'O'};
  message[10] = static_cast<std::byte>(bytes - 16);
  return message;
}

RecordedPing ping_at(double at_s, std::size_t bytes = 64) {
  auto ping = std::make_shared<Ping>();
  ping->request.number = PingNumber{7};
  ping->request.bodies_in_world = {Pose{{1, 2, 3}, {}}};
  ping->truth = {{2.5f, 1}, {}};
  auto names = std::make_shared<SceneNames>();
  *names = {{"floor", "box"}, {"crate"}, {}};
  return {Time{} + nanoseconds_from(at_s),   ping, std::make_shared<const protocol::Bytes>(oculus_message(bytes)), {},
          protocol::Bytes(20, std::byte{2}), names};
}

TEST(RecordingFile, HasAStatusPerSecondAndTheTruthOfEveryPing) {
  recording::Bytes bytes;
  RecordingFile file(recording::sink_into(bytes), &RecordingFile::mcap, {"front", "oculus", {}});
  for (const double at_s : {0.0, 0.5, 0.999, 1.0, 1.5}) EXPECT_TRUE(file.write(ping_at(at_s)));
  EXPECT_TRUE(file.close());
  EXPECT_EQ(file.figures().pings, 5u);
  EXPECT_EQ(file.figures().messages, 7u);
  EXPECT_EQ(file.figures().bytes, bytes.size());
  auto reader = recording::mcap::Reader::open(recording::source_from("it", bytes));
  ASSERT_TRUE(reader);
  std::map<std::string, int> found;
  std::string truth;
  while (const auto message = reader->next()) {
    const std::string& topic = reader->channels().at(message->channel).topic;
    ++found[topic];
    if (topic != "/front/truth") continue;
    truth.clear();
    for (const std::byte b : message->data) truth += static_cast<char>(b);
  }
  EXPECT_THAT(found, ElementsAre(std::pair("/front/device", 5), std::pair("/front/pose", 5), std::pair("/front/status", 2),
                                 std::pair("/front/truth", 5), std::pair("/tf", 10)));
  EXPECT_THAT(truth,
              HasSubstr(R"("range_m":[2.5,0.0],"object":[1,-1],"objects":[{"index":1,"name":"box"}],"bodies":[{"name":"crate")"));
}

TEST(RecordingFile, KeepsLabelsOnRequest) {
  for (const bool asked : {false, true}) {
    const RecordedPing plain = ping_at(0);
    auto ping = std::make_shared<Ping>(*plain.ping);
    ping->labels = std::make_shared<PingLabels>(PingLabels{1, 3, {2, 0, 0}, {200, 0, 0}, {0, 0, 3}, {-1, 0.25f, 0}});
    auto names = std::make_shared<SceneNames>(*plain.names);
    names->instances = {{"floor", "mud"}, {"box", "mine"}, {"crate", "stone"}};
    RecordedPing labelled = plain;
    labelled.ping = ping, labelled.names = names;
    EXPECT_EQ(labelled.size(), plain.size() + 15);
    recording::Bytes bytes;
    RecordingFile file(recording::sink_into(bytes), &RecordingFile::mcap, {"front", "oculus", {}}, asked);
    EXPECT_TRUE(file.write(labelled));
    EXPECT_TRUE(file.close());
    auto reader = recording::mcap::Reader::open(recording::source_from("it", bytes));
    ASSERT_TRUE(reader);
    std::map<std::string, std::string> found;
    while (const auto message = reader->next()) {
      std::string& text = found[reader->channels().at(message->channel).topic];
      for (const std::byte b : message->data) text += static_cast<char>(b);
    }
    EXPECT_EQ(found.count("/front/labels") + found.count("/front/instances"), asked ? 2u : 0u);
    if (!asked) continue;
    EXPECT_TRUE(found["/front/labels"].ends_with(std::string("\2\0\0\0\0\0", 6)));
    EXPECT_TRUE(found["/front/share"].ends_with(std::string("\xc8\0\0", 3)));
    EXPECT_TRUE(found["/front/caster"].ends_with(std::string("\0\0\0\0\3\0", 6)));
    EXPECT_THAT(found["/front/instances"], HasSubstr(R"("instances":[{"instance":2,"name":"box","class":"mine","visible":0.25},)"
                                                     R"({"instance":3,"name":"crate","class":"stone","visible":0.0}])"));
  }
}

TEST(RecordingFile, AnExistingFileIsNotTouched) {
  const Folder folder;
  const std::filesystem::path file = folder.path + "/mine.mcap";
  std::ofstream(file) << "mine";
  const auto made = RecordingFile::create(file, &RecordingFile::mcap, {"front", "oculus", {}});
  ASSERT_FALSE(made);
  EXPECT_THAT(made.error().text, HasSubstr("exists already"));
  EXPECT_EQ(std::filesystem::file_size(file), 4u);
}

TEST(RecordingConfig, NamesAFolderThatIsThere) {
  const Folder folder;
  std::ofstream(folder.path + "/scene.yaml") << "name: test\n";
  std::filesystem::create_directory(folder.path + "/here");
  const auto read = [&](const std::string& section) {
    return parse_config(
        "world: {scene: scene.yaml}\nvehicles: [{name: rov}]\n"
        "sonars: [{name: front, profile: oculus-m1200d, bind_ip: 127.0.0.2}]\n" +
            section,
        "c.yaml", folder.path);
  };
  const auto none = read(""), here = read("recording: {folder: here}\n"),
             absolute = read("recording: {folder: " + folder.path + "}\n");
  ASSERT_TRUE(none && here && absolute) << (here ? "" : here.error().text);
  EXPECT_TRUE(none->recording.folder.empty());
  EXPECT_EQ(here->recording.folder, std::filesystem::path(folder.path) / "here");
  EXPECT_EQ(absolute->recording.folder, folder.path);
  EXPECT_THAT(read("recording: {folder: there}\n").error().text, HasSubstr("c.yaml:4:21: recording.folder: is not a folder: "));
  EXPECT_THAT(read("recording: {folder: scene.yaml}\n").error().text, HasSubstr("is not a folder"));
  EXPECT_THAT(read("recording: {folder: here, format: mcap}\n").error().text, HasSubstr("recording.format: unknown key"));
}

// ---- the queue

struct Queue {
  explicit Queue(std::size_t most_waiting_bytes) {
    config.recording.folder = folder.path;
    LogOptions options;
    options.sink = [this](LogLevel, const std::string& line) { lines.push_back(line); };
    log.emplace(options);
    recordings.emplace(
        writer, config, *log, [] {}, most_waiting_bytes);
  }
  void run() {
    io.restart();
    io.run();
  }
  Folder folder;
  Config config;
  asio::io_context io{1};
  WriterThread writer{io, 0};
  std::vector<std::string> lines;
  std::optional<Log> log;
  std::optional<Recordings> recordings;
};

TEST(Recordings, ASlowDiskEndsTheRecordingWithOneLine) {
  Queue q(1);
  Result<void> begun = failure(ErrorKind::bug, "not answered");
  q.recordings->start({"slow.mcap"}, {"front", "oculus", {}}, "test", [&](const Result<void>& r) { begun = r; });
  EXPECT_FALSE(q.recordings->takes("front")) << "no ping is recorded before the file is open";
  q.run();
  ASSERT_TRUE(begun) << begun.error().text;
  ASSERT_TRUE(q.recordings->takes("front"));
  EXPECT_FALSE(q.recordings->takes("rear"));
  q.recordings->take("front", ping_at(0));
  EXPECT_TRUE(q.recordings->takes("front"));
  q.recordings->take("front", ping_at(0.1));  // arrives before the first ping is written
  EXPECT_FALSE(q.recordings->takes("front"));
  q.recordings->take("front", ping_at(0.2));
  q.run();
  EXPECT_TRUE(q.recordings->idle());
  const auto status = q.recordings->status().at(0);
  EXPECT_FALSE(status.running());
  EXPECT_EQ(status.pings(), 1u);
  EXPECT_THAT(status.why(), HasSubstr("written too slowly"));
  ASSERT_EQ(q.lines.size(), 2u);
  EXPECT_THAT(q.lines[1], HasSubstr("recording stopped: its file is written too slowly"));
  EXPECT_EQ(messages_in(status.file()), 1u);
}

TEST(Recordings, TheRecordingWithMostWaitingBytesEndsFirst) {
  Queue q(3 * ping_at(0).size());
  for (const char* sonar : {"front", "rear"})
    q.recordings->start({std::string(sonar) + ".mcap"}, {sonar, "oculus", {}}, "test",
                        [](const Result<void>& r) { ASSERT_TRUE(r); });
  q.run();
  q.recordings->take("front", ping_at(0));
  q.recordings->take("front", ping_at(0.1));
  q.recordings->take("rear", ping_at(0.1));
  EXPECT_TRUE(q.recordings->takes("front") && q.recordings->takes("rear"));
  q.recordings->take("rear", ping_at(0.2));
  EXPECT_FALSE(q.recordings->takes("front"));
  EXPECT_TRUE(q.recordings->takes("rear"));
  q.run();
  q.recordings->stop({}, [](const Result<void>& r) { EXPECT_TRUE(r); });
  q.run();
  EXPECT_EQ(messages_in(q.recordings->status().at(0).file()), 2u);
  EXPECT_EQ(messages_in(q.recordings->status().at(1).file()), 2u);
}

TEST(Recordings, AreLimitedToAFewInTheConfiguredFolder) {
  Queue q(1 << 20);
  std::vector<std::string> answers;
  const auto start = [&](const std::string& name) {
    q.recordings->start({name}, {"front", "oculus", {}}, "test",
                        [&](const Result<void>& r) { answers.push_back(r ? "ok" : r.error().text); });
  };
  for (const char* name : {"1.raw", "2.raw", "3.raw", "4.raw", "5.raw"}) start(name);
  q.run();
  ASSERT_EQ(answers.size(), 5u);
  EXPECT_THAT(answers[0], HasSubstr("4 recordings are under way already"));  // refused at once
  EXPECT_EQ(std::count(answers.begin(), answers.end(), "ok"), 4);
  answers.clear();
  q.recordings->stop({"7.raw"}, [&](const Result<void>& r) { answers.push_back(r ? "ok" : r.error().text); });
  q.recordings->stop({}, [&](const Result<void>& r) { answers.push_back(r ? "ok" : r.error().text); });
  q.run();
  EXPECT_THAT(answers, ElementsAre("no recording is called \"7.raw\"", "ok"));
  answers.clear();
  for (int round = 0; round < 12; ++round) {  // only the last ended recordings are remembered
    start("again-" + std::to_string(round) + ".raw");
    q.run();
    q.recordings->stop({}, [](const Result<void>&) {});
    q.run();
  }
  EXPECT_EQ(std::count(answers.begin(), answers.end(), "ok"), 12);
  EXPECT_EQ(q.recordings->status().size(), Recordings::most_remembered);
  EXPECT_EQ(q.recordings->status().back().why(), "stop requested");
  answers.clear();
  q.config.recording.folder.clear();
  start("6.raw");
  q.config.recording.folder = q.folder.path + "/gone";
  start("6.raw");
  q.run();
  ASSERT_EQ(answers.size(), 2u);
  EXPECT_THAT(answers[0], HasSubstr("recording: {folder: DIR}"));
  EXPECT_THAT(answers[1], HasSubstr("No such file or directory"));
  EXPECT_TRUE(q.recordings->idle());
}

TEST(Recordings, LabelsAreRecordedOnlyForSonarsThatHaveThem) {
  Queue q(1 << 20);
  const auto answer = [&](const std::string& name, const char* vendor) {
    std::string text = "not answered";
    q.recordings->start({name, "front", true}, {"front", vendor, {}, std::string_view(vendor) == "waterlinked"}, "test",
                        [&](const Result<void>& r) { text = r ? "ok" : r.error().text; });
    q.run();
    return text;
  };
  EXPECT_THAT(answer("run.oculus", "oculus"), HasSubstr("labels are recorded in MCAP only"));
  EXPECT_THAT(answer("run.mcap", "waterlinked"), HasSubstr("range images have no labels"));
  q.config.engine.switches.fixed_fan = 40;
  EXPECT_THAT(answer("run.mcap", "oculus"), HasSubstr("labels need the canonical model"));
  q.config.engine.switches = {};
  EXPECT_FALSE(q.recordings->wants_labels("front"));
  EXPECT_EQ(answer("run.mcap", "oculus"), "ok");
  EXPECT_TRUE(q.recordings->wants_labels("front"));
  q.recordings->stop({}, [](const Result<void>& r) { EXPECT_TRUE(r); });
  q.run();
  EXPECT_FALSE(q.recordings->wants_labels("front"));
}

// ---- with clients

DaemonSetup recording_setup(const Folder& folder) {
  DaemonSetup setup;
  setup.moving_object = true;
  setup.more = "recording: {folder: '" + folder.path + "'}\n";
  return setup;
}

TEST(RecordedDaemon, ClientsAndFileHaveTheSameBytes) {
  std::vector<std::string> digests;
  for (const bool recorded : {false, true}) {
    const Folder folder;
    DaemonSetup setup = recording_setup(folder);
    setup.more += "clock: stepped\n";
    setup.options.exit_after_pings = 30;
    setup.options.digest = true;
    Daemon daemon(setup);
    for (const char* name : {"run.mcap", "run.oculus"})
      if (recorded) {
        EXPECT_EQ(daemon.ask(control::StartRecording{name}).text, "");
      }
    Client client(daemon.address());
    client.digest.emplace();
    client.fire(fire_at(PingRate::hz40));
    EXPECT_TRUE(client.read_to_end());
    EXPECT_EQ(daemon.wait(), 0);
    digests.push_back(daemon.app().devices().front().digests().at(0).sha256);
    EXPECT_EQ(digests.back(), client.digest->hex());
    const auto requests = daemon.requests();
    EXPECT_EQ(requests.at(0).switches.keep_truth, recorded);
    if (!recorded) continue;
    Sha256 kept;
    const auto opened = recording::open_recording(std::filesystem::path(folder.path + "/run.oculus"));
    ASSERT_TRUE(opened);
    while (const auto message = opened->reader->next()) kept.add(message->bytes);
    EXPECT_EQ(kept.hex(), digests.back()) << "the client received only pings";
    EXPECT_EQ(messages_in(folder.path + "/run.mcap"), 30u);
  }
  EXPECT_EQ(digests[0], digests[1]);
}

TEST(RecordedDaemon, IsListedInTheStatusAndStopsWhenRequested) {
  const Folder folder;
  Daemon daemon(recording_setup(folder));
  EXPECT_EQ(daemon.ask(control::StartRecording{"run.mcap", "rear"}).text, "no sonar is called \"rear\"; there are: front");
  EXPECT_EQ(daemon.ask(control::StopRecording{}).code, OperationResult::Code::refused);
  EXPECT_EQ(daemon.ask(control::StartRecording{"run.mcap", "front"}).code, OperationResult::Code::done);
  EXPECT_EQ(daemon.ask(control::StartRecording{"run.mcap", "front"}).code, OperationResult::Code::failed) << "the file exists";
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  EXPECT_TRUE(eventually([&] {
    client.next_ping(milliseconds(100));
    return daemon.status().recordings().at(0).pings() >= 3;
  }));
  EXPECT_TRUE(daemon.status().recordings().at(0).running());
  EXPECT_EQ(daemon.ask(control::StopRecording{"run.mcap"}).code, OperationResult::Code::done);
  const auto told = daemon.status().recordings().at(0);
  EXPECT_FALSE(told.running());
  EXPECT_EQ(told.why(), "stop requested");
  EXPECT_EQ(told.file(), folder.path + "/run.mcap");
  EXPECT_EQ(messages_in(told.file()), told.pings()) << "the file is complete when the stop is answered";
  EXPECT_EQ(std::filesystem::file_size(told.file()), told.bytes());
  EXPECT_TRUE(client.next_ping());
  EXPECT_EQ(daemon.stop(), 0);
}

TEST(RecordedDaemon, AFullDiskEndsTheRecordingAndNothingElse) {
  const Folder folder;
  Daemon daemon(recording_setup(folder));
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  const SmallDisk disk(3'000'000);
  ASSERT_EQ(daemon.ask(control::StartRecording{"run.mcap"}).text, "");
  std::uint32_t last = 0;
  std::uint64_t missing = 0;
  ASSERT_TRUE(eventually([&] {
    const auto ping = client.next_ping();
    if (ping && last != 0) missing += ping->head.fixed.ping_id - last - 1;
    if (ping) last = ping->head.fixed.ping_id;
    return !daemon.status().recordings().at(0).running();
  }));
  EXPECT_TRUE(client.next_ping());
  std::string nothing;
  EXPECT_TRUE(eventually([&] {
    nothing = daemon.ask(control::StopRecording{}).text;
    return nothing.find("nothing is being recorded") == 0;
  }));
  EXPECT_THAT(nothing, HasSubstr("has ended: ")) << "the answer to a stop has the reason";
  EXPECT_THAT(nothing, HasSubstr("File too large"));
  const auto told = daemon.status().recordings().at(0);
  EXPECT_THAT(told.why(), HasSubstr("File too large"));
  EXPECT_EQ(daemon.stop(), 0);
  EXPECT_LE(missing, daemon.figures().dropped) << "missing pings were dropped because the client did not read";
  const std::string log = daemon.log_text();
  const auto first = log.find("recording stopped: cannot write more to " + told.file());
  EXPECT_NE(first, std::string::npos) << log;
  EXPECT_EQ(log.find("recording stopped", first + 1), std::string::npos) << log;
  EXPECT_EQ(log.find("recording ended"), std::string::npos) << log;
  const std::uint64_t kept = messages_in(told.file());
  EXPECT_GT(kept, 0u);
  EXPECT_LT(kept, told.pings());
}

TEST(RecordedDaemon, TheRecordingOfASonarThatAReloadRemovesEnds) {
  const Folder folder;
  DaemonSetup setup = recording_setup(folder);
  setup.config_file = setup.options.handle_signals = true;
  const std::string other = "127.0.0.3";
  const auto also = [&other](const char* name) {
    return std::string("  - {name: ") + name + ", profile: oculus-m1200d, bind_ip: " + other + ", status_to: ['" + other +
           ":9'], device_id: 9}\n";
  };
  setup.sonar_lines = also("rear");
  Daemon daemon(setup);
  EXPECT_EQ(daemon.ask(control::StartRecording{"rear.mcap", "rear"}).text, "");
  EXPECT_EQ(daemon.ask(control::StartRecording{"front.mcap", "front"}).text, "");
  setup.sonar_lines = also("aft");
  daemon.write_config(yaml_of(setup));
  ASSERT_EQ(kill(getpid(), SIGHUP), 0);
  ASSERT_TRUE(eventually([&] { return !daemon.status().recordings().at(0).running(); }));
  EXPECT_EQ(daemon.status().recordings().at(0).why(), "the configuration changed");
  EXPECT_TRUE(daemon.status().recordings().at(1).running());
  EXPECT_EQ(daemon.stop(), 0);
  EXPECT_EQ(messages_in(folder.path + "/rear.mcap"), 0u) << "the file is complete and has no ping";
}

TEST(RecordedDaemon, AReloadThatFailsDoesNotEndTheRecording) {
  const Folder folder;
  DaemonSetup setup = recording_setup(folder);
  setup.config_file = setup.options.handle_signals = true;
  Daemon daemon(setup);
  setup.address = "127.0.0.3";
  DaemonSetup other;
  other.address = setup.address;
  const Daemon holds_the_other_address(other);
  EXPECT_EQ(daemon.ask(control::StartRecording{"front.mcap"}).text, "");
  daemon.write_config(yaml_of(setup));
  ASSERT_EQ(kill(getpid(), SIGHUP), 0);
  ASSERT_TRUE(eventually([&] { return daemon.log_text().find("front as before") != std::string::npos; })) << daemon.log_text();
  EXPECT_TRUE(daemon.status().recordings().at(0).running());
  EXPECT_EQ(daemon.stop(), 0);
}

TEST(RecordedDaemon, AStopOfTheDaemonFinishesTheFile) {
  const Folder folder;
  Daemon daemon(recording_setup(folder));
  EXPECT_EQ(daemon.ask(control::StartRecording{"run.mcap"}).text, "");
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  ASSERT_TRUE(client.next_ping());
  EXPECT_EQ(daemon.stop(), 0);
  EXPECT_TRUE(daemon.app().files_are_written());
  EXPECT_GE(messages_in(folder.path + "/run.mcap"), 2u);
}

}  // namespace
}  // namespace sonar::testing_daemon::recordings_test
