// The scene changes while sonars ping: no ping is lost, each is computed with the scene of its request, and a failed change has
// no effect.
#include <gmock/gmock.h>

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <fstream>

#include "protocol/control/answers.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon::scene_change_test {
namespace {

using oculus::PingRate;
using ::testing::HasSubstr;
using ::testing::Not;
using Code = OperationResult::Code;

/// Blocks its callers until it is opened.
class Gate {
 public:
  void pass() {
    std::unique_lock lock(mutex_);
    ++arrived_;
    opens_.wait_for(lock, patience, [this] { return open_; });
  }
  void open() {
    std::lock_guard lock(mutex_);
    open_ = true;
    opens_.notify_all();
  }
  int arrived() {
    std::lock_guard lock(mutex_);
    return arrived_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable opens_;
  bool open_ = false;
  int arrived_ = 0;
};

control::AddObject added(const std::string& name, bool moving = false) { return {name, "box", {}, Pose{{1, 2, -3}, {}}, moving}; }
int objects_in(const v1::DaemonStatus& status) { return status.objects_size(); }

TEST(SceneChange, PingsUseTheOldSceneUntilTheNewOneIsReady) {
  auto gate = std::make_shared<Gate>();
  DaemonSetup setup;
  setup.before_engine = [gate](const Scene&) { gate->pass(); };
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  auto answer = daemon.ask_later(added("buoy"));
  ASSERT_TRUE(eventually([&] { return gate->arrived() == 1; }));
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(client.next_ping()) << "while the scene is being built";
  EXPECT_EQ(daemon.scenes().back()->objects.size(), 2u);
  EXPECT_EQ(objects_in(daemon.status()), 2);
  EXPECT_NE(answer.wait_for(milliseconds(0)), std::future_status::ready);
  gate->open();
  EXPECT_EQ(answer.get().code, Code::done);
  EXPECT_EQ(objects_in(daemon.status()), 3);
  const std::size_t by_now = daemon.scenes().size() + 1;  // a request may be on its way to the engine
  ASSERT_TRUE(eventually([&] { return daemon.scenes().size() > by_now; }));
  EXPECT_EQ(daemon.scenes().back()->objects.size(), 3u);
  EXPECT_THAT(daemon.log_text(), HasSubstr("scene: object buoy added"));
}

TEST(SceneChange, UnderLoadNoPingIsLostAndEachHasTheBodiesOfItsScene) {
  DaemonSetup setup;
  setup.moving_object = true;
  setup.engine_takes = milliseconds(3);
  setup.before_engine = [](const Scene&) { std::this_thread::sleep_for(milliseconds(15)); };
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  std::atomic<bool> over{false};
  std::thread changes([&] {
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(daemon.ask(added("whale", true)).code, Code::done);
      EXPECT_TRUE(eventually([&, by_now = daemon.scenes().size()] { return daemon.scenes().size() > by_now + 1; }));
      control::RemoveObject gone;
      gone.object = "whale";
      EXPECT_EQ(daemon.ask(gone).code, Code::done);
    }
    over = true;
  });
  std::optional<std::uint32_t> last;
  std::uint64_t skipped = 0;
  int seen = 0;
  while (!over || seen < 20) {
    const auto ping = client.next_ping();
    if (!ping) break;
    ++seen;
    if (last) {
      EXPECT_GT(ping->head.fixed.ping_id, *last);
      skipped += ping->head.fixed.ping_id - *last - 1;
    }
    last = ping->head.fixed.ping_id;
  }
  changes.join();
  daemon.stop();
  const auto requests = daemon.requests();
  const auto scenes = daemon.scenes();
  ASSERT_EQ(requests.size(), scenes.size());
  std::size_t with_whale = 0;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    EXPECT_EQ(static_cast<std::uint32_t>(requests[i].number), i + 1) << "every ping that was fired was made";
    EXPECT_EQ(requests[i].bodies_in_world.size(), scenes[i]->body_names.size());
    if (scenes[i]->body_names.size() == 2) {
      ++with_whale;
      EXPECT_EQ(requests[i].bodies_in_world[1].position_m.y, 2);
    }
  }
  EXPECT_GT(with_whale, 0u);
  EXPECT_LE(skipped, daemon.figures().dropped) << "only pings for which the client was too slow are missing";
  EXPECT_EQ(daemon.figures().refused, 0u);
}

/// Making an engine delays pings. A client that changes the scene continuously must not reduce the ping rate of others.
TEST(SceneChange, TheRateOfNewEnginesIsLimitedWhileADriverIsServed) {
  Daemon daemon;
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  constexpr int beyond = 3;
  const auto begin = Steady::now();
  for (int i = 0; i < SceneChanges::most_at_once + beyond; ++i)
    EXPECT_EQ(daemon.ask(added("buoy " + std::to_string(i))).code, Code::done);
  EXPECT_GE(Steady::now() - begin, (beyond - 1) * SceneChanges::between_engines);
  EXPECT_EQ(objects_in(daemon.status()), 2 + SceneChanges::most_at_once + beyond) << "no object is lost";
}

/// Edits that wait at the same time need only one new engine. If one of them cannot be made, only that one fails.
TEST(SceneChange, EditsThatWaitShareAnEngine) {
  auto gate = std::make_shared<Gate>();
  DaemonSetup setup;
  setup.before_engine = [gate](const Scene&) { gate->pass(); };
  Daemon daemon(setup);
  auto first = daemon.ask_later(added("first"));
  ASSERT_TRUE(eventually([&] { return gate->arrived() == 1; }));
  std::vector<std::future<OperationResult>> others;
  for (const char* const name : {"second", "second", "third"}) others.push_back(daemon.ask_later(added(name)));
  gate->open();
  EXPECT_EQ(first.get().code, Code::done);
  EXPECT_EQ(others[0].get().code, Code::done);
  EXPECT_NE(others[1].get().code, Code::done) << "an object of this name exists";
  EXPECT_EQ(others[2].get().code, Code::done);
  EXPECT_EQ(objects_in(daemon.status()), 5);
  EXPECT_EQ(gate->arrived(), 2) << "engines";
}

TEST(SceneChange, EditsThatShareAnEngineDoNotFailTogether) {
  auto gate = std::make_shared<Gate>();
  DaemonSetup setup;
  setup.before_engine = [gate](const Scene& scene) {
    gate->pass();
    if (object_named(scene, "too much") != nullptr) throw std::bad_alloc();
  };
  Daemon daemon(setup);
  auto first = daemon.ask_later(added("first"));
  ASSERT_TRUE(eventually([&] { return gate->arrived() == 1; }));
  std::vector<std::future<OperationResult>> others;
  for (const char* const name : {"second", "too much", "third"}) others.push_back(daemon.ask_later(added(name)));
  gate->open();
  EXPECT_EQ(first.get().code, Code::done);
  EXPECT_EQ(others[0].get().code, Code::done);
  EXPECT_EQ(others[1].get().code, Code::failed);
  EXPECT_EQ(others[2].get().code, Code::done);
  EXPECT_EQ(objects_in(daemon.status()), 5);
}

TEST(SceneChange, ChangesQueueInOrder) {
  auto gate = std::make_shared<Gate>();
  DaemonSetup setup;
  setup.before_engine = [gate](const Scene&) { gate->pass(); };
  Daemon daemon(setup);
  auto first = daemon.ask_later(added("one"));
  auto second = daemon.ask_later(control::AddObject{"two", "one", {}, {}, true});
  auto third = daemon.ask_later(control::SetObject{"two", {}, Pose{{7, 0, 0}, {}}});
  auto fourth = daemon.ask_later(control::RemoveObject{"one"});
  auto wrong = daemon.ask_later(control::RemoveObject{"one"});
  gate->open();
  EXPECT_EQ(first.get().code, Code::done);
  EXPECT_EQ(second.get().code, Code::done);
  EXPECT_EQ(third.get().code, Code::done) << "the object was added just before";
  EXPECT_EQ(fourth.get().code, Code::done);
  const OperationResult again = wrong.get();
  EXPECT_EQ(again.code, Code::refused);
  EXPECT_THAT(again.text, HasSubstr("no object \"one\""));
  const auto objects = daemon.status().objects();
  ASSERT_EQ(objects.size(), 3);
  EXPECT_EQ(objects[2].name(), "two");
  EXPECT_EQ(objects[2].position().x(), 7);
}

TEST(SceneChange, AnAnsweredClientMayRequestAgainAtOnce) {
  Daemon daemon;
  std::vector<OperationResult::Code> answers;  // used only on the I/O thread
  daemon.on_io_thread([&] {
    Operations& operations = daemon.app().operations();
    const auto keep = [&answers](OperationResult result) { answers.push_back(result.code); };
    operations.perform(added("one"), {"control test", "control"}, [&operations, keep](OperationResult result) {
      keep(result);
      operations.perform(control::RemoveObject{"one"}, {"control test", "control"}, keep);
    });
    operations.perform(added("two"), {"control test", "control"}, keep);
  });
  ASSERT_TRUE(eventually([&] {
    std::size_t answered = 0;
    daemon.on_io_thread([&] { answered = answers.size(); });
    return answered == 3;
  }));
  EXPECT_EQ(answers, (std::vector<Code>{Code::done, Code::done, Code::done}));
  EXPECT_EQ(daemon.status().objects_size(), 3);
}

TEST(SceneChange, AFailureChangesNothing) {
  DaemonSetup setup;
  setup.options.load_scene = [](const SceneFile& file) -> Result<ScenePointer> {
    return failure(ErrorKind::bad_data, file.name() + ":3:5: objects[0].typ: unknown key");
  };
  setup.before_engine = [](const Scene&) { throw std::bad_alloc(); };
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  const OperationResult bad = daemon.ask(control::LoadScene{"demo.yaml"});
  EXPECT_EQ(bad.code, Code::failed);
  EXPECT_THAT(bad.text, HasSubstr("objects[0].typ: unknown key"));
  const OperationResult missing = daemon.ask(control::LoadScene{"no/such.yaml"});
  EXPECT_EQ(missing.code, Code::refused);
  EXPECT_THAT(missing.text, HasSubstr("no scene file \"no/such.yaml\"; looked in"));
  const OperationResult no_memory = daemon.ask(added("buoy"));
  EXPECT_EQ(no_memory.code, Code::failed);
  EXPECT_THAT(no_memory.text, HasSubstr("not enough memory; use a smaller scene, or raise"));
  EXPECT_EQ(objects_in(daemon.status()), 2);
  EXPECT_THAT(daemon.status().scene(), HasSubstr("scene.yaml"));
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(client.next_ping());
  for (const ScenePointer& scene : daemon.scenes()) EXPECT_EQ(scene->objects.size(), 2u);
}

TEST(SceneChange, ErrorsOfForeignFilesAreOnlyInTheLog) {
  const std::string file = ::testing::TempDir() + "secret" + std::to_string(::getpid()) + ".yaml";
  std::ofstream(file) << "password\n";
  DaemonSetup setup;
  setup.options.load_scene = [](const SceneFile& f) -> Result<ScenePointer> {  // the error has the texts of the loader
    std::string word;
    std::ifstream(f.path) >> word;
    return failure(ErrorKind::bad_data, f.name() + ":1:1: expected a map, found \"" + word + "\"");
  };
  Daemon daemon(setup);
  for (const char* other : {"/etc/passwd", "", "/proc/self/environ"}) {
    const OperationResult refused = daemon.ask(control::LoadScene{other});
    EXPECT_EQ(refused.code, Code::refused);
    EXPECT_THAT(refused.text, HasSubstr("the names of scenes end in .yaml or .yml"));
  }
  const OperationResult answer = daemon.ask(control::LoadScene{file});
  EXPECT_EQ(answer.code, Code::failed);
  EXPECT_THAT(answer.text, HasSubstr(file + " could not be loaded: the scene file has errors, see sonard's log"));
  EXPECT_THAT(answer.text, Not(HasSubstr("password")));
  EXPECT_THAT(daemon.log_text(), HasSubstr("password"));
  std::filesystem::remove(file);
}

TEST(SceneChange, ALoadedSceneKeepsThePosesOfBodiesItAlsoHas) {
  const auto other = small_scene(true);
  other->name = "other";
  other->body_names.push_back("whale");
  other->bodies_in_world.push_back(Pose{{0, 8, -2}, {}});
  DaemonSetup setup;
  setup.moving_object = true;
  setup.options.load_scene = [other](const SceneFile&) -> Result<ScenePointer> { return ScenePointer(other); };
  Daemon daemon(setup);
  ASSERT_EQ(daemon.ask(control::SetObject{"crate", {}, Pose{{4, 4, -4}, {}}}).code, Code::done);
  ASSERT_EQ(daemon.ask(control::LoadScene{"demo.yaml"}).code, Code::done);
  EXPECT_THAT(daemon.status().scene(), HasSubstr("demo.yaml"));
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  const PingRequest request = daemon.requests().back();
  ASSERT_EQ(request.bodies_in_world.size(), 2u);
  EXPECT_EQ(request.bodies_in_world[0].position_m.y, 4);
  EXPECT_EQ(request.bodies_in_world[1].position_m.y, 8);
}

TEST(SceneChange, MovingObjectsAreMovedAndHiddenWithoutANewScene) {
  DaemonSetup setup;
  setup.moving_object = true;
  setup.before_engine = [](const Scene&) { ADD_FAILURE() << "an engine was built"; };
  Daemon daemon(setup);
  ASSERT_EQ(daemon.ask(control::SetObject{"crate", {}, Pose{{2, 0, -3}, {}}}).code, Code::done);
  EXPECT_EQ(daemon.status().objects(2).position().x(), 2);
  ASSERT_EQ(daemon.ask(control::SetObject{"crate", false, {}}).code, Code::done);
  EXPECT_FALSE(daemon.status().objects(2).visible());
  ASSERT_EQ(daemon.ask(control::SetObject{"crate", {}, Pose{{3, 0, -3}, {}}}).code, Code::done);
  EXPECT_FALSE(daemon.status().objects(2).visible()) << "a pose alone does not show the object";
  ASSERT_EQ(daemon.ask(control::SetObject{"crate", true, {}}).code, Code::done);
  EXPECT_TRUE(daemon.status().objects(2).visible());
  EXPECT_EQ(daemon.status().objects(2).position().x(), 3);
}

TEST(SceneChange, SteppedTimeDoesNotPassMeanwhile) {
  auto gate = std::make_shared<Gate>();
  DaemonSetup setup;
  setup.more = "clock: stepped\n";
  setup.before_engine = [gate](const Scene&) { gate->pass(); };
  Daemon daemon(setup);
  auto answer = daemon.ask_later(added("buoy"));
  ASSERT_TRUE(eventually([&] { return gate->arrived() == 1; }));
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  EXPECT_FALSE(client.next_ping(milliseconds(150))) << "no step while the scene is being built";
  EXPECT_TRUE(daemon.requests().empty());
  gate->open();
  EXPECT_EQ(answer.get().code, Code::done);
  ASSERT_TRUE(client.next_ping());
  EXPECT_EQ(daemon.requests().front().fired_at, Time{}) << "no simulated time has passed";
  EXPECT_EQ(daemon.scenes().front()->objects.size(), 3u);
}

TEST(SceneChange, StoppingDoesNotWaitForAnswersThatAreNotRead) {
  auto gate = std::make_shared<Gate>();
  DaemonSetup setup;
  setup.before_engine = [gate](const Scene&) { gate->pass(); };
  Daemon daemon(setup);
  auto answer = daemon.ask_later(added("buoy"));
  ASSERT_TRUE(eventually([&] { return gate->arrived() == 1; }));
  EXPECT_EQ(daemon.stop(), 0) << "run() returns while the engine is being built";
  gate->open();
  EXPECT_THROW(answer.get(), std::future_error) << "no answer was given";
}

}  // namespace
}  // namespace sonar::testing_daemon::scene_change_test
