// SIGHUP: the configuration is read again. Unchanged sonars keep their clients, the others follow the file, and a
// file with errors changes nothing. The tests send the signal to their own process, as a user would.
#include <gmock/gmock.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <future>
#include <thread>

#include "core/base/memory_left.hpp"
#include "daemon/config/restart_keys.hpp"
#include "protocol/control/answers.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using oculus::PingRate;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

DaemonSetup with_file() {
  DaemonSetup setup;
  setup.options.handle_signals = true;
  setup.config_file = true;
  return setup;
}

/// Returns one more sonar, for DaemonSetup::sonar_lines.
std::string sonar(const std::string& name, const std::string& address, int device_id, const std::string& more = {}) {
  return "  - name: " + name + "\n    profile: oculus-m1200d\n    bind_ip: " + address + "\n    status_to: ['" + address +
         ":9']\n    device_id: " + std::to_string(device_id) + "\n" + more;
}

std::size_t times(const std::string& text, const std::string& words) {
  std::size_t n = 0;
  for (std::size_t at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++n;
  return n;
}

/// Sends the signal and waits until the log has `nth` lines with these words.
[[nodiscard]] bool reload(Daemon& daemon, const std::string& words, std::size_t nth = 1) {
  if (kill(getpid(), SIGHUP) != 0) return false;
  return eventually([&] { return times(daemon.log_text(), words) >= nth; });
}

TEST(Reload, ASonarThatIsOpenedAnewGetsThePlanOfFaults) {
  DaemonSetup setup = with_file();
  setup.more = "faults: {armed: true, plan: [{name: late, do: L05, at: {time_s: 900}}]}\n";
  Daemon daemon(setup);
  EXPECT_EQ(daemon.status().faults_size(), 1);
  const std::string second = "127.0.0.3";
  setup.sonar_lines = sonar("rear", second, 77);
  daemon.write_config(yaml_of(setup));
  ASSERT_TRUE(reload(daemon, "reloaded:"));
  const auto status = daemon.status();
  ASSERT_EQ(status.faults_size(), 2) << "each sonar has one fault";
  EXPECT_EQ(status.faults(1).sonar(), "rear");
  EXPECT_EQ(status.faults(1).name(), "late");
}

TEST(Reload, ManyHangupsAtOnceReadTheFileTwice) {
  std::promise<void> let_go;
  DaemonSetup setup = with_file();
  setup.options.load_scene = [goes = let_go.get_future().share()](const SceneFile&) -> Result<ScenePointer> {
    goes.wait();
    return std::make_shared<const Scene>();
  };
  Daemon daemon(setup);
  daemon.on_io_thread([] {
    for (int i = 0; i < 10; ++i) ASSERT_EQ(raise(SIGHUP), 0);
  });
  EXPECT_EQ(times(daemon.log_text(), "reloaded:"), 0u) << "the first reload is still loading";
  let_go.set_value();
  ASSERT_TRUE(eventually([&] { return times(daemon.log_text(), "reloaded:") >= 2; }));
  ASSERT_TRUE(reload(daemon, "reloaded:", 3)) << "a later signal reads the file again";
  daemon.stop();
  EXPECT_EQ(times(daemon.log_text(), "reloaded:"), 3u)
      << "one for the first signal, one for all during it, one for the later signal";
}

TEST(Reload, QuickReloadsAreAtMostTwoPerSecond) {
  Daemon daemon(with_file());
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz2));
  const auto first = client.next_ping();
  ASSERT_TRUE(first);
  const auto begin = Steady::now();
  while (Steady::now() - begin < milliseconds(1200)) {
    ASSERT_EQ(kill(getpid(), SIGHUP), 0);
    std::this_thread::sleep_for(milliseconds(1));
  }
  ASSERT_TRUE(eventually([&] { return times(daemon.log_text(), "reloaded:") >= 2; }));
  const std::size_t reloaded = times(daemon.log_text(), "reloaded:");
  const double lasted_s = std::chrono::duration<double>(Steady::now() - begin).count();
  EXPECT_LE(static_cast<double>(reloaded), 2 + 2 * lasted_s);
  for (std::uint32_t i = 1; i <= 4; ++i) {
    const auto ping = client.next_ping();
    ASSERT_TRUE(ping);
    EXPECT_EQ(ping->head.fixed.ping_id, first->head.fixed.ping_id + i) << "reloads skip no ping";
  }
  daemon.stop();
}

TEST(Reload, ASceneThatNeedsTooMuchMemoryChangesNothing) {
  const std::filesystem::path root = own_path("memory");
  std::filesystem::create_directories(root / "proc");
  std::ofstream(root / "proc/meminfo") << "MemAvailable: 1 kB\n";
  DaemonSetup setup = with_file();
  setup.options.load_scene = [root](const SceneFile&) -> Result<ScenePointer> {
    memory_root() = root;  // the memory is too small only after the files are read
    return small_scene(true);
  };
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  ASSERT_TRUE(reload(daemon, "of memory, and 0 MiB are left to this process"));
  EXPECT_THAT(daemon.log_text(), HasSubstr("the configuration stays as it was"));
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(client.next_ping());
  memory_root() = "/";
  std::filesystem::remove_all(root);
}

/// Returns small_scene(), lowered by this depth.
ScenePointer sunk_scene(double by_m) {
  auto scene = small_scene();
  for (Object& o : scene->objects) o.in_world.position_m.z -= by_m;
  return scene;
}

TEST(Reload, NotesAreOnTheNewConfigurationInTheNewScene) {
  DaemonSetup setup = with_file();
  setup.options.load_scene = [](const SceneFile&) -> Result<ScenePointer> { return sunk_scene(100); };
  Daemon daemon(setup);
  std::string yaml = yaml_of(setup);
  const std::string place = "xyz_m: [0, 0, -3]";
  yaml.replace(yaml.find(place), place.size(), "xyz_m: [0, 0, -103]");
  daemon.write_config(yaml);
  ASSERT_TRUE(reload(daemon, "reloaded:"));
  EXPECT_THAT(daemon.status().notes(), IsEmpty());
  EXPECT_THAT(daemon.log_text(), Not(HasSubstr("from everything in the scene")));
  daemon.write_config(yaml_of(setup));
  ASSERT_TRUE(reload(daemon, "reloaded:", 2));
  EXPECT_EQ(daemon.status().notes_size(), 1);
  EXPECT_THAT(daemon.log_text(), HasSubstr("m from everything in the scene")) << "the vehicle is now far from the scene";
}

TEST(Reload, ALoadThatTakesTooLongIsReportedAsAProblem) {
  std::promise<void> let_go;
  DaemonSetup setup = with_file();
  setup.more = "limits: {load_s: 1}\n";
  setup.options.load_scene = [goes = let_go.get_future().share()](const SceneFile&) -> Result<ScenePointer> {
    goes.wait();
    return std::make_shared<const Scene>();
  };
  Daemon daemon(setup);
  const auto trouble = [&] {
    std::string text;
    daemon.on_io_thread([&] { text = daemon.app().operations().problem(); });
    return text;
  };
  ASSERT_EQ(kill(getpid(), SIGHUP), 0);
  EXPECT_TRUE(eventually([&] { return trouble().find("a change of the scene has been loading for ") == 0; }));
  EXPECT_TRUE(eventually([&] { return times(daemon.log_text(), "longer than limits.load_s") == 1; }))
      << "the log line is not repeated";
  let_go.set_value();
  EXPECT_TRUE(eventually([&] { return trouble().empty(); }));
}

TEST(Reload, UntouchedSonarsContinueWhileOthersAreAddedChangedOrRemoved) {
  const std::string left = "127.0.0.3", rear = "127.0.0.4", up = "127.0.0.5";
  DaemonSetup setup = with_file();
  setup.sonar_lines = "    device_id: 7001\n" + sonar("left", left, 7002) + sonar("rear", rear, 7003);
  Daemon daemon(setup);
  Client client(daemon.address()), of_left(left), of_rear(rear);
  client.fire(fire_at(PingRate::hz40));
  auto once = fire_at(PingRate::hz10);  // no bytes wait for these clients at the reload, because they read late
  once.settings.flags |= oculus::flag::network_trigger;
  of_left.fire(once);
  of_rear.fire(once);
  ASSERT_TRUE(client.next_ping() && of_left.next_ping() && of_rear.next_ping());

  // The front is unchanged, left has another device id, rear is gone, up is new.
  setup.sonar_lines = "    device_id: 7001\n" + sonar("left", left, 7012) + sonar("up", up, 7004);
  daemon.write_config(yaml_of(setup));
  ASSERT_TRUE(reload(daemon, "reloaded: front untouched, left changed, up added, rear removed"));

  EXPECT_TRUE(of_left.read_to_end()) << "the stream ends with a whole message and a FIN";
  EXPECT_TRUE(of_rear.read_to_end());
  Client of_up(up), again(left);
  of_up.fire(fire_at(PingRate::hz10));
  again.fire(fire_at(PingRate::hz10));
  EXPECT_TRUE(of_up.next_ping());
  const auto ping = again.next_ping();
  ASSERT_TRUE(ping);
  EXPECT_EQ(ping->head.fixed.header.source, 7012);

  std::uint32_t last = 0;
  std::uint64_t skipped = 0;
  for (int i = 0; i < 10; ++i) {  // pings from before the reload come first
    const auto next = client.next_ping();
    ASSERT_TRUE(next);
    EXPECT_GT(next->head.fixed.ping_id, last) << "no ping is sent twice";
    skipped += last == 0 ? 0 : next->head.fixed.ping_id - last - 1;
    last = next->head.fixed.ping_id;
  }
  daemon.stop();
  EXPECT_LE(skipped, daemon.figures().dropped) << "only pings for which the client was too slow are missing";
  EXPECT_EQ(daemon.figures().clients, 1u);
  std::uint32_t number = 0;
  for (const PingRequest& r : daemon.requests())
    if (r.sonar_id == 0) {
      EXPECT_EQ(static_cast<std::uint32_t>(r.number), ++number);
    }
}

TEST(Reload, AnErrorChangesNothing) {
  DaemonSetup setup = with_file();
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  daemon.write_config("world: {scene: scene.yaml}\nvehicles: [{name: rov}]\nsonors: []\n");
  ASSERT_TRUE(reload(daemon, "the configuration stays as it was"));
  EXPECT_THAT(daemon.log_text(), HasSubstr("did you mean \"sonars\"?"));
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(client.next_ping());
  daemon.write_config(yaml_of(setup));
  ASSERT_TRUE(reload(daemon, "reloaded: front untouched"));
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(client.next_ping());
}

TEST(Reload, ASceneThatCannotBeLoadedChangesNothing) {
  DaemonSetup setup = with_file();
  setup.options.load_scene = [](const SceneFile& f) -> Result<ScenePointer> {
    return failure(ErrorKind::bad_data, f.name() + ": no such mesh");
  };
  Daemon daemon(setup);
  setup.sonar_lines = sonar("left", "127.0.0.3", 7002);
  daemon.write_config(yaml_of(setup));
  ASSERT_TRUE(reload(daemon, "no such mesh; the configuration stays as it was"));
  EXPECT_EQ(daemon.status().sonars_size(), 1);
}

TEST(Reload, ASonarThatCannotBeOpenedStaysAsItWas) {
  DaemonSetup setup = with_file();
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  DaemonSetup elsewhere = setup;
  elsewhere.address = "192.0.2.17";  // an address of no computer
  elsewhere.sonar_lines = "    status_to: ['127.0.0.1:9']\n" + sonar("left", "192.0.2.18", 7002);
  elsewhere.more = "poses: {protobuf: off, json: off}\n";
  daemon.write_config(yaml_of(elsewhere));
  ASSERT_TRUE(reload(daemon, "reloaded: front as before, left missing"));
  EXPECT_THAT(daemon.log_text(), HasSubstr("reload: sonar left: cannot listen on 192.0.2.18:52100"));
  EXPECT_THAT(daemon.log_text(), HasSubstr("reload: sonar front: cannot listen on 192.0.2.17:52100"));
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(client.next_ping());
  daemon.on_io_thread([&] { EXPECT_THAT(daemon.app().operations().problem(), HasSubstr("192.0.2.")); });
  daemon.write_config(yaml_of(setup));
  ASSERT_TRUE(reload(daemon, "reloaded: front untouched"));
  daemon.on_io_thread([&] { EXPECT_THAT(daemon.app().operations().problem(), IsEmpty()); });
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(client.next_ping());
}

TEST(Reload, AnOptionOfAnotherVendorChangesNoSonar) {
  DaemonSetup setup = with_file();
  Daemon daemon(setup);
  setup.sonar_lines = "    options: {heads_base: strict}\n";  // options of BlueView
  daemon.write_config(yaml_of(setup));
  EXPECT_TRUE(reload(daemon, "reloaded: front untouched"));
  setup.sonar_lines = "    options: {dummy_period_ms: 600}\n";
  daemon.write_config(yaml_of(setup));
  EXPECT_TRUE(reload(daemon, "reloaded: front changed"));
}

TEST(Reload, SonarsMayExchangeAddresses) {
  const std::string other = "127.0.0.3";
  DaemonSetup setup = with_file();
  setup.sonar_lines = "    device_id: 7001\n" + sonar("left", other, 7002);
  Daemon daemon(setup);
  DaemonSetup swapped = setup;
  swapped.address = other;
  swapped.sonar_lines = "    device_id: 7001\n" + sonar("left", daemon.address(), 7002);
  daemon.write_config(yaml_of(swapped));
  ASSERT_TRUE(reload(daemon, "reloaded: front changed, left changed"));
  Client of_front(other);
  of_front.fire(fire_at(PingRate::hz40));
  const auto ping = of_front.next_ping();
  ASSERT_TRUE(ping);
  EXPECT_EQ(ping->head.fixed.header.source, 7001);
  EXPECT_EQ(daemon.requests().back().sonar_id, 0u) << "a sonar keeps its noise at another address";
}

TEST(Reload, WaterMountsVehiclesAndSeedAreTakenOver) {
  DaemonSetup setup = with_file();
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  std::string text = yaml_of(setup);
  const auto put = [&text](const std::string& old, const std::string& now) { text.replace(text.find(old), old.size(), now); };
  put("{scene: scene.yaml}", "{scene: scene.yaml, seed: 99, water: {temperature_c: 4}}");
  put("  - {name: rov,", "  - {name: buoy}\n  - {name: rov,");
  put("    profile:", "    vehicle: rov\n    mount: {frame: FLU, xyz_m: [0, 0, 1]}\n    profile:");
  daemon.write_config(text);
  ASSERT_TRUE(reload(daemon, "reloaded: front moved"));
  const std::size_t by_now = daemon.requests().size();
  ASSERT_TRUE(eventually([&] { return daemon.requests().size() > by_now + 1; }));
  const PingRequest last = daemon.requests().back();
  EXPECT_EQ(last.water.temperature_c, 4);
  EXPECT_EQ(last.sonar_in_world.position_m.z, -2) << "the sonar is on the rov, which is now the second vehicle";
  EXPECT_EQ(static_cast<std::uint64_t>(last.seed), 99u);
  EXPECT_EQ(daemon.status().vehicles_size(), 2);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(client.next_ping());
}

TEST(Reload, ChangesByControlAreUndone) {
  DaemonSetup setup = with_file();
  Daemon daemon(setup);
  control::SetSonar tilt;
  tilt.mount = control::MountChange{Vec3d{0, 0, 5}, {}};
  ASSERT_EQ(daemon.ask(tilt).code, OperationResult::Code::done);
  control::SetEnvironment cold;
  cold.temperature_c = 1;
  ASSERT_EQ(daemon.ask(cold).code, OperationResult::Code::done);
  ASSERT_EQ(daemon.ask(control::AddObject{"buoy", "box", {}, {}, false}).code, OperationResult::Code::done);
  ASSERT_TRUE(reload(daemon, "reloaded: front moved"));
  const v1::DaemonStatus s = daemon.status();
  EXPECT_EQ(s.sonars(0).position().z(), -3);
  EXPECT_EQ(s.environment().temperature_c().value(), 12);
  EXPECT_EQ(s.objects_size(), 2);
}

TEST(Reload, TheSameSceneIsNotBuiltAgain) {
  DaemonSetup setup = with_file();
  setup.options.load_scene = [](const SceneFile&) -> Result<ScenePointer> { return ScenePointer(small_scene()); };
  setup.before_engine = [](const Scene&) { ADD_FAILURE() << "an engine was built"; };
  Daemon daemon(setup);
  ASSERT_TRUE(reload(daemon, "reloaded: front untouched"));
}

TEST(Reload, KeysThatNeedARestartAreNamedInOneWarning) {
  DaemonSetup setup = with_file();
  Daemon daemon(setup);
  setup.more += "clock: stepped\nengine: {threads: 7}\nlog: {level: error}\n";
  daemon.write_config(yaml_of(setup));
  ASSERT_TRUE(reload(daemon, "these need a restart and stay as they were: engine.threads, clock, log"));
  EXPECT_EQ(daemon.status().clock(), "realtime");
  ASSERT_TRUE(reload(daemon, "these need a restart", 2)) << "the warning is repeated while the file has these keys";
}

TEST(Reload, ManyReloadsLeaveNoState) {
  const std::string left = "127.0.0.3";
  DaemonSetup setup = with_file();
  setup.sonar_lines = "    status_to: ['127.0.0.1:9']\n";
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  const DaemonSetup alone = setup;
  setup.sonar_lines += sonar("left", left, 7002);
  for (std::size_t i = 1; i <= 4; ++i) {
    daemon.write_config(yaml_of(setup));
    ASSERT_TRUE(reload(daemon, "left added", i));
    Client of_left(left);
    of_left.fire(fire_at(PingRate::hz10));
    ASSERT_TRUE(of_left.next_ping());
    daemon.write_config(yaml_of(alone));
    ASSERT_TRUE(reload(daemon, "left removed", i));
    EXPECT_TRUE(of_left.read_to_end());
  }
  ASSERT_TRUE(client.next_ping());
  EXPECT_EQ(daemon.status().sonars_size(), 1);
  EXPECT_EQ(daemon.stop(), 0);
  EXPECT_THAT(daemon.log_text(), Not(HasSubstr("internal fault")));
}

TEST(KeepWhatNeedsARestart, NamesAndRestoresChangedKeys) {
  const Config now = *demo_config();
  Config next = *demo_config();
  EXPECT_THAT(keep_restart_keys(now, next), IsEmpty());
  next.poses.json.enabled = false;
  next.control.hosts = {"sonar.example"};
  next.engine.simd = SimdLevel::portable;
  next.poses.max_jump_m = 7;
  EXPECT_THAT(keep_restart_keys(now, next), ElementsAre("poses.json", "control", "engine.simd"));
  EXPECT_TRUE(next.poses.json.enabled);
  EXPECT_EQ(next.poses.max_jump_m, 7) << "keys that need no restart keep their new values";
}

}  // namespace
}  // namespace sonar::testing_daemon
