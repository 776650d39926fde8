// Tests time that other programs advance, with control requests (lockstep) or stamps of poses (follow). Answers come when the
// pings have been sent.
#include <gmock/gmock.h>

#include "protocol/control/answers.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using control::ClockDomain;
using control::PoseSample;
using control::Step;
using oculus::PingRate;
using std::chrono::nanoseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using Code = OperationResult::Code;

DaemonSetup with_clock(const std::string& mode, const std::string& more = "") {
  DaemonSetup setup;
  setup.more = "clock: " + mode + "\ncontrol: {stream: '127.0.0.1:0', http: off}\n" + more;
  return setup;
}

/// A daemon whose sonar pings at 40 Hz for one client. The client reads continuously, because simulated
/// time waits for readers.
struct Pinging {
  explicit Pinging(DaemonSetup setup) : daemon(std::move(setup)), client(daemon.address()) {
    client.fire(fire_at(PingRate::hz40));
    EXPECT_TRUE(eventually([&] { return daemon.status().sonars().at(0).pinging(); }));
    reader = std::thread([this] {
      while (auto ping = client.next_ping(patience)) received.push_back(std::move(*ping));
      client.close();
    });
  }
  ~Pinging() { stop(); }
  int stop() {
    const int code = daemon.stop();
    if (reader.joinable()) reader.join();
    return code;
  }
  v1::Stepped step(double dt_s) {
    const OperationResult done = daemon.ask(Step{dt_s});
    EXPECT_EQ(done.code, Code::done) << done.text;
    return *done.stepped;
  }
  static PoseSample sample(double x, nanoseconds stamp, const std::string& vehicle = "") {
    PoseSample s;
    s.name = vehicle;
    s.pose.position_m = {x, 0, -3};
    s.stamp = {ClockDomain::sim, stamp.count()};
    return s;
  }
  OperationResult pose(double x, nanoseconds stamp, const std::string& vehicle = "") {
    return daemon.ask(sample(x, stamp, vehicle));
  }
  std::vector<double> times_ms() {
    std::vector<double> times;
    for (const PingRequest& r : daemon.requests()) times.push_back(1e3 * seconds(r.fired_at.time_since_epoch()));
    return times;
  }
  std::vector<double> xs() {
    std::vector<double> all;
    for (const PingRequest& r : daemon.requests()) all.push_back(r.vehicle_in_world.position_m.x);
    return all;
  }
  Daemon daemon;
  Client client;
  std::thread reader;
  std::vector<oculus::DecodedPing> received;  // complete after stop()
};

TEST(Lockstep, TimeStandsStillUntilAStepWhoseAnswerComesAfterItsPings) {
  Pinging p(with_clock("lockstep"));
  std::this_thread::sleep_for(milliseconds(50));
  EXPECT_TRUE(p.daemon.requests().empty());
  EXPECT_EQ(p.daemon.status().clock(), "lockstep");

  const v1::Stepped first = p.step(0.05);  // pings at 0 and 25 ms; the ping at 50 ms belongs to the next step
  EXPECT_EQ(first.now_ns(), 50'000'000);
  EXPECT_EQ(first.pings(), 2u);
  EXPECT_THAT(p.times_ms(), ElementsAre(0, 25));
  EXPECT_EQ(p.daemon.status().sonars().at(0).clients().at(0).pings_written(), 2u) << "both pings have been sent";
  EXPECT_EQ(p.daemon.status().now_ns(), 50'000'000);
  EXPECT_EQ(p.step(0.01).pings(), 1u);
  const v1::Stepped none = p.step(0.01);
  EXPECT_EQ(none.pings(), 0u);
  EXPECT_EQ(none.now_ns(), 70'000'000);
  EXPECT_THAT(p.times_ms(), ElementsAre(0, 25, 50));
}

TEST(Lockstep, StepsThatWaitAreDoneOneAfterTheOther) {
  DaemonSetup setup = with_clock("lockstep");
  setup.engine_takes = milliseconds(5);
  Pinging p(std::move(setup));
  std::vector<std::future<OperationResult>> steps;
  for (int i = 0; i < 8; ++i) steps.push_back(p.daemon.ask_later(Step{0.025}));
  for (int i = 0; i < 8; ++i) {
    const v1::Stepped done = *steps[static_cast<std::size_t>(i)].get().stepped;
    EXPECT_EQ(done.now_ns(), (i + 1) * 25'000'000);
    EXPECT_EQ(done.pings(), 1u);
  }
  EXPECT_EQ(p.daemon.requests().size(), 8u);
}

TEST(Lockstep, APoseIsUsedFromTheNextStepOn) {
  Pinging p(with_clock("lockstep"));
  for (int i = 0; i < 4; ++i) {
    PoseSample s;
    s.pose.position_m = {0.01 * i, 0, -3};
    ASSERT_EQ(p.daemon.ask(s).code, Code::done);
    p.step(0.025);
  }
  EXPECT_THAT(p.xs(), ElementsAre(0, 0.01, 0.02, 0.03));
}

TEST(Lockstep, RefusesInvalidSteps) {
  Pinging p(with_clock("lockstep"));
  for (const double dt_s : {0.0, -1.0, 3601.0, 1e-12}) EXPECT_EQ(p.daemon.ask(Step{dt_s}).code, Code::refused) << dt_s;
  EXPECT_THAT(p.daemon.ask(Step{-1}).text, HasSubstr("more than 0 and at most 3600"));
  EXPECT_TRUE(p.daemon.requests().empty());
  DaemonSetup stepped = with_clock("stepped");
  stepped.address = "127.0.0.3";
  Daemon other(stepped);
  EXPECT_THAT(other.ask(Step{1}).text, HasSubstr("only with clock: lockstep; here it is clock: stepped"));
}

TEST(Lockstep, TheNumberOfWaitingStepsIsLimited) {
  const Clock clock(true);
  const World world({}, {{"rov", {}, false}}, {}, Time{});
  SteppedTime time(ClockMode::lockstep, clock, world);
  for (std::size_t i = 0; i < SteppedTime::most_waiting; ++i) {
    ASSERT_EQ(time.step(1e-6), "");
    time.wait([](Time, bool) {});
  }
  EXPECT_THAT(time.step(1e-6), HasSubstr("4096 requests wait"));
  time.answer({});
  EXPECT_EQ(time.step(1e-6), "");
}

TEST(Lockstep, TheStepOfAClientThatHasLeftEndsAndLaterStepsKeepTheirLength) {
  Clock clock(true);
  const World world({}, {{"rov", {}, false}}, {}, Time{});
  SteppedTime time(ClockMode::lockstep, clock, world);
  std::vector<std::string> ended;
  bool first_left = false;
  const auto wait = [&](const std::string& name, HasLeft has_left) {
    time.wait(
        [&ended, name](Time then, bool is_whole) {
          ended.push_back(name + (is_whole ? " whole at " : " cut at ") +
                          std::to_string(then.time_since_epoch().count() / 1000000));
        },
        std::move(has_left));
  };
  ASSERT_EQ(time.step(3600), "");
  wait("first", [&] { return first_left; });
  ASSERT_EQ(time.step(0), "dt_s must be more than 0 and at most 3600 seconds");
  clock.advance_to(Time(milliseconds(1500)));
  EXPECT_FALSE(time.end_left());
  ASSERT_THAT(time.step(10), HasSubstr("would take more than 3600 seconds")) << "3598.5 s are waiting already";
  first_left = true;
  EXPECT_TRUE(time.end_left());
  EXPECT_FALSE(time.end_left());
  EXPECT_THAT(ended, ElementsAre("first cut at 1500"));
  EXPECT_EQ(time.bound().then, Time(milliseconds(1500)));

  first_left = false;
  ASSERT_EQ(time.step(10), "");
  wait("second", [&] { return first_left; });
  ASSERT_EQ(time.step(0.25), "");
  wait("third", {});
  clock.advance_to(Time(milliseconds(2000)));
  first_left = true;
  EXPECT_TRUE(time.end_left());
  EXPECT_EQ(time.bound().then, Time(milliseconds(2250)));
  clock.advance_to(Time(milliseconds(2250)));
  EXPECT_TRUE(time.answer({}));
  EXPECT_THAT(ended, ElementsAre("first cut at 1500", "second cut at 2000", "third whole at 2250"));
}

TEST(Lockstep, AStepEndsWhenItsClientLeavesWhileAnotherWaits) {
  DaemonSetup setup = with_clock("lockstep");
  setup.engine_takes = milliseconds(5);
  Pinging p(std::move(setup));
  const auto left = std::make_shared<std::atomic<bool>>(false);
  std::promise<OperationResult> cut;
  p.daemon.on_io_thread([&] {
    p.daemon.app().operations().perform(
        Step{3000}, {"control test", "control"}, [&cut](OperationResult result) { cut.set_value(std::move(result)); },
        [left] { return left->load(); });
  });
  EXPECT_TRUE(eventually([&] { return p.daemon.requests().size() > 2; }));
  auto other = p.daemon.ask_later(Step{0.05});
  *left = true;
  auto answer = cut.get_future();
  ASSERT_EQ(answer.wait_for(patience), std::future_status::ready);
  const OperationResult first = answer.get();
  EXPECT_EQ(first.code, Code::failed);
  EXPECT_THAT(first.text, HasSubstr("its client closed the connection"));
  ASSERT_EQ(other.wait_for(patience), std::future_status::ready);
  const std::int64_t now_ns = other.get().stepped->now_ns();
  EXPECT_LT(now_ns, 2'000'000'000'000);
  EXPECT_EQ(p.daemon.status().now_ns(), now_ns) << "time stands still again";
}

TEST(Lockstep, ADaemonThatStopsAnswersNoStep) {
  DaemonSetup setup = with_clock("lockstep");
  setup.engine_takes = milliseconds(20);
  Pinging p(std::move(setup));
  auto step = p.daemon.ask_later(Step{3600});
  EXPECT_TRUE(eventually([&] { return !p.daemon.requests().empty(); }));
  EXPECT_EQ(p.stop(), 0);
}

TEST(Follow, TimeComesFromPosesAndPingsLieBetweenTwoPoses) {
  Pinging p(with_clock("follow"));
  std::this_thread::sleep_for(milliseconds(50));
  EXPECT_TRUE(p.daemon.requests().empty()) << "without a pose, time does not begin";

  const nanoseconds start = std::chrono::hours(400000);  // about the present UNIX time
  ASSERT_EQ(p.pose(0, start).code, Code::done);
  EXPECT_EQ(p.daemon.status().now_ns(), start.count());
  EXPECT_EQ(p.daemon.requests().size(), 1u)
      << "the first ping is due exactly at the first stamp, and sent when that pose is answered";
  ASSERT_EQ(p.pose(0.1, start + milliseconds(100)).code, Code::done);
  const auto requests = p.daemon.requests();
  ASSERT_EQ(requests.size(), 5u);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(requests[static_cast<std::size_t>(i)].fired_at, Time(start + i * milliseconds(25)));
    EXPECT_NEAR(requests[static_cast<std::size_t>(i)].vehicle_in_world.position_m.x, 0.025 * i, 1e-12)
        << "the position is interpolated between two poses";
  }
  EXPECT_EQ(p.daemon.status().sonars().at(0).figures().skipped_ticks(), 0u) << "no ping was due before the first pose";
  p.stop();
  ASSERT_EQ(p.received.size(), 5u);
  EXPECT_NEAR(p.received.front().head.fixed.ping_start_time_s, 0, 1e-6) << "the device was powered up when its time began";
}

TEST(Follow, ARestartedSimulatorDoesNotSetTimeBack) {
  Pinging p(with_clock("follow"));
  p.pose(0, std::chrono::seconds(100));
  p.pose(0, std::chrono::seconds(100) + milliseconds(50));
  ASSERT_EQ(p.daemon.requests().size(), 3u);
  p.pose(5, milliseconds(10));  // from the same sender
  p.pose(5, milliseconds(35));
  const auto requests = p.daemon.requests();
  ASSERT_EQ(requests.size(), 4u);
  EXPECT_EQ(requests[3].fired_at, Time(std::chrono::seconds(100) + milliseconds(75)));
  EXPECT_EQ(requests[3].vehicle_in_world.position_m.x, 5);
}

TEST(Follow, AJumpAheadSkipsTheTimeBetween) {
  Pinging p(with_clock("follow"));
  p.pose(0, milliseconds(0));
  p.pose(0, milliseconds(25));
  p.pose(9, std::chrono::seconds(3600));
  const auto requests = p.daemon.requests();
  ASSERT_EQ(requests.size(), 2u) << "a jump does not change the time to the next ping";
  p.pose(9, std::chrono::seconds(3600) + milliseconds(25));
  EXPECT_EQ(p.daemon.requests().back().fired_at, Time(std::chrono::seconds(3600) + milliseconds(25)));
  EXPECT_EQ(p.daemon.status().sonars().at(0).figures().skipped_ticks(), 0u);
  EXPECT_THAT(p.daemon.log_text(), HasSubstr("time follows the poses: it jumps ahead by 3599.975"));
}

TEST(Follow, TimeBeginsAtTheFirstPoseEvenIfItsStampIsSmall) {
  Pinging p(with_clock("follow"));
  p.pose(0, milliseconds(550));
  const auto requests = p.daemon.requests();
  ASSERT_EQ(requests.size(), 1u) << "no ping was due before the pose";
  EXPECT_EQ(requests[0].fired_at, Time(milliseconds(550)));
}

TEST(Follow, AVehicleThatJoinsWithAnOlderStampDelaysNoOther) {
  DaemonSetup setup = with_clock("follow");
  setup.engine_takes = milliseconds(30);
  setup.vehicle_lines = "  - {name: boat}\n";
  setup.sonar_lines = "    vehicle: rov\n";
  Pinging p(std::move(setup));
  EXPECT_EQ(p.pose(0, std::chrono::seconds(100), "rov").code, Code::done);
  auto ahead = p.daemon.ask_later(p.sample(0, std::chrono::seconds(100) + milliseconds(900), "rov"));
  auto behind = p.daemon.ask_later(p.sample(0, std::chrono::seconds(100) + milliseconds(50), "boat"));
  ASSERT_EQ(ahead.wait_for(patience), std::future_status::ready);
  ASSERT_EQ(behind.wait_for(patience), std::future_status::ready);
}

TEST(Follow, ASenderThatWaitsForAnswersGetsEveryPing) {
  Pinging p(with_clock("follow", "poses: {protobuf: '127.0.0.1:0', json: off, stale_after_s: 5}\n"));
  p.pose(0, milliseconds(0));
  p.pose(3, std::chrono::seconds(3));
  EXPECT_EQ(p.daemon.requests().size(), 121u);
  EXPECT_EQ(p.daemon.status().sonars().at(0).figures().skipped_ticks(), 0u);
}

TEST(Follow, StampsThatJumpAreLogged) {
  Pinging p(with_clock("follow"));
  p.pose(0, std::chrono::seconds(100));
  p.pose(0, std::chrono::seconds(100) + milliseconds(50));
  EXPECT_THAT(p.daemon.log_text(), Not(HasSubstr("do not continue from")));
  p.pose(5, milliseconds(10));
  EXPECT_THAT(p.daemon.log_text(), HasSubstr("stamps of rov do not continue from the last one"));
}

TEST(Follow, APoseWithoutATimeIsRefused) {
  Pinging p(with_clock("follow"));
  PoseSample arrival;
  const OperationResult refused = p.daemon.ask(arrival);
  EXPECT_EQ(refused.code, Code::refused);
  EXPECT_THAT(refused.text, HasSubstr("no time stamp"));
  EXPECT_TRUE(p.daemon.requests().empty());
}

TEST(Follow, ASimulatorThatDoesNotWaitLosesTicksAsInRealTime) {
  DaemonSetup setup = with_clock("follow", "poses: {protobuf: '127.0.0.1:0', json: off}\n");
  const auto gate = setup.gate = std::make_shared<PingGate>();
  Pinging p(std::move(setup));
  const std::uint16_t port = p.daemon.app().poses().protobuf().port;
  for (int i = 0; i <= 100; ++i)  // five seconds at once: 201 ticks
    send_udp("127.0.0.1", port, control::encode_pose_datagram(p.sample(0.01 * i, i * milliseconds(50))));
  ASSERT_TRUE(eventually([&] {
    const v1::PoseFigures poses = p.daemon.status().poses();
    return poses.accepted() + poses.replaced() == 101;
  }));
  gate->open();  // the first ping is ready only after all poses have arrived
  ASSERT_TRUE(eventually([&] { return p.daemon.status().now_ns() == 5'000'000'000; }));
  ASSERT_TRUE(eventually([&] {
    const auto figures = p.daemon.status().sonars().at(0).figures();
    return figures.pings() + figures.skipped_ticks() == 201;
  })) << "every tick is a ping or counted as skipped";
  const auto requests = p.daemon.requests();
  EXPECT_LT(requests.size(), 100u);
  EXPECT_GE(requests.size(), 41u) << "the last second has all of its pings";
  EXPECT_EQ(requests.back().fired_at, Time(std::chrono::seconds(5)));
}

}  // namespace
}  // namespace sonar::testing_daemon
