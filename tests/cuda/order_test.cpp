// The order of a device's threads and queues and the addresses of its memory are arbitrary. The bytes must not depend on them,
// and no step may read memory that was not written.
#include <gtest/gtest.h>

#include <iterator>
#include <set>
#include <stdexcept>

#include "tests/core/pipeline/basin.hpp"
#include "tests/cuda/comparing.hpp"
#include "tests/cuda/strange_machines.hpp"

namespace sonar::test {
namespace {

using cuda::LoopOrder;

std::vector<PingRequest> requests() {
  std::vector<PingRequest> all;
  const std::set<std::string> wanted{"everything, high", "everything, low",     "expected power, high",
                                     "blank, low",       "somewhere else, low", "flat beams, high"};
  for (auto& [what, request] : turns())
    if (wanted.count(what) > 0) {
      request.switches.multipath = what == "everything, high";
      all.push_back(with_wide_beams(std::move(request)));
    }
  EXPECT_EQ(all.size(), wanted.size());
  return all;
}

using MachinePointer = std::unique_ptr<cuda::Machine>;

std::vector<Ping> pings_of(MachinePointer machine, const std::shared_ptr<const Scene>& scene, const std::vector<PingRequest>& all,
                           cuda::DeviceEngineOptions options = {.batch = 3}) {
  Parallel pool(1);
  // After an exception of a machine the engine does not continue on the CPU.
  options.cpu_after_failure = false;
  const auto engine = cuda::make_device_engine(scene, pool, {.simd = SimdLevel::portable}, std::move(machine), options);
  return engine->run(all);
}

void expect_same(const std::vector<Ping>& there, const std::vector<Ping>& again) {
  ASSERT_EQ(there.size(), again.size());
  for (std::size_t i = 0; i < there.size(); ++i) {
    EXPECT_EQ(there[i].samples, again[i].samples) << i;
    EXPECT_EQ(there[i].pressure_upa, again[i].pressure_upa) << i;
    EXPECT_EQ(there[i].beam_signal_upa, again[i].beam_signal_upa) << i;
    EXPECT_EQ(compare(there[i], again[i]).truth, true) << i;
  }
}

struct Device {
  const char* name;
  MachinePointer (*make)();
};
class AnyDevice : public ::testing::TestWithParam<Device> {};

TEST_P(AnyDevice, MakesTheSameBytes) {
  const auto scene = basin();
  const std::vector<PingRequest> all = requests();
  expect_same(pings_of(cuda::make_host_loops(), scene, all), pings_of(GetParam().make(), scene, all));
}

INSTANTIATE_TEST_SUITE_P(
    Order, AnyDevice,
    ::testing::Values(Device{"Backwards", [] { return cuda::make_host_loops(LoopOrder::backwards); }},
                      Device{"Scattered", [] { return cuda::make_host_loops(LoopOrder::scattered); }},
                      Device{"Deferring", []() -> MachinePointer { return std::make_unique<DeferringMachine>(); }},
                      Device{"Threaded", []() -> MachinePointer { return std::make_unique<ThreadedMachine>(); }},
                      Device{"Piecewise", []() -> MachinePointer { return std::make_unique<PiecewiseMachine>(); }}),
    [](const auto& of) { return std::string(of.param.name); });

// Checks that this machine detects a source of a copy that is reused too early, and a missing order of lanes.
TEST(DeferringDevice, DoesAllWorkAsLateAsTheOrderAllows) {
  DeferringMachine machine;
  auto* host = static_cast<int*>(machine.allocate_host(sizeof(int)));
  auto* back = static_cast<int*>(machine.allocate_host(sizeof(int)));
  auto* device = static_cast<int*>(machine.allocate(sizeof(int)));
  *host = 1, *back = 0;
  machine.upload(2, device, host, sizeof(int));
  machine.download(0, back, device, sizeof(int));
  *host = 2;
  machine.wait(0);
  EXPECT_EQ(*back, -1) << "no order was set: lane 0 does not wait for lane 2";
  machine.order(0, 2);
  machine.download(0, back, device, sizeof(int));
  *host = 3;
  machine.wait(0);
  EXPECT_EQ(*back, 3);
  machine.upload(2, device, host, sizeof(int));
  machine.release_host(host);
  EXPECT_THROW(machine.wait(2), std::logic_error);
  machine.release(device);
  machine.release_host(back);
}

// Cells are evicted and sent again, there are more sets of settings than the engine keeps, and batches have two sizes. Steps that
// run late must find their data.
TEST(DeferringDevice, FindsItsDataAsTheyWereQueued) {
  const auto scene = basin();
  std::vector<PingRequest> all;
  const PingRequest wide = requests().at(0);
  for (int k = 0; k < 20; ++k) {
    PingRequest r = wide;
    r.switches.multipath = false;
    r.settings.range_bin_count = 20 + 2 * (k % 10);  // more sets of settings than the engine keeps
    r.number = PingNumber{static_cast<std::uint32_t>(k)};
    r.sonar_in_world.position_m.x += 0.2 * (k % 3);
    all.push_back(std::move(r));
  }
  const auto there = pings_of(cuda::make_host_loops(), scene, all);
  for (const auto& options : {cuda::DeviceEngineOptions{.cell_bytes = 1, .batch = 2}, cuda::DeviceEngineOptions{.batch = 5}})
    expect_same(there, pings_of(std::make_unique<DeferringMachine>(), scene, all, options));
}

// Pings of several sonars, in calls of one and of three. Either each call runs alone, or it is submitted while up to two earlier
// calls are not collected yet.
class Grouped : public ::testing::TestWithParam<std::size_t> {};

TEST_P(Grouped, MakesTheSameBytes) {
  const auto scene = basin();
  std::vector<PingRequest> all = requests();
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].sonar_id = static_cast<std::uint32_t>(i % 3);
    all[i].switches.multipath = false;
  }
  for (const std::size_t again : {0u, 2u}) all.push_back(PingRequest(all[again]));
  const std::vector<Ping> there = pings_of(cuda::make_host_loops(), scene, all, {.batch = 1});
  Parallel pool(2);
  const auto engine = cuda::make_device_engine(scene, pool, {.simd = SimdLevel::portable}, std::make_unique<DeferringMachine>(),
                                               {.batch = 2, .cpu_after_failure = false});
  for (const bool pipelined : {false, true}) {
    std::vector<Ping> pings;
    const auto add = [&](std::vector<Ping> more) {
      EXPECT_EQ(engine->statistics_of_each().size(), more.size());
      std::move(more.begin(), more.end(), std::back_inserter(pings));
    };
    std::size_t under_way = 0;
    for (std::span<const PingRequest> left = all; !left.empty();) {
      const auto some = left.first(std::min(GetParam(), left.size()));
      left = left.subspan(some.size());
      if (!pipelined) {
        add(engine->run(some));
        continue;
      }
      engine->submit(some);
      if (++under_way < 3) continue;
      add(engine->collect());
      --under_way;
    }
    for (; under_way > 0; --under_way) add(engine->collect());
    expect_same(there, pings);
  }
}
INSTANTIATE_TEST_SUITE_P(BySize, Grouped, ::testing::Values(1, 3), ::testing::PrintToStringParamName());

TEST(DeviceEngine, ComputesPingsOfOneSizeTogether) {
  Parallel two(2), many(16);
  const auto scene = basin();
  const auto most = [&](Parallel& pool, const PingRequest& a, const PingRequest& b, int batch = 4) {
    return cuda::make_device_engine(scene, pool, {}, cuda::make_host_loops(), {.batch = batch})->most_together(a, b);
  };
  PingRequest a = requests().at(1);
  a.switches.multipath = false;
  PingRequest b = a;
  b.sonar_id = 7;
  EXPECT_EQ(most(two, a, b), 2u);
  EXPECT_EQ(most(many, a, b), 4u);
  EXPECT_EQ(most(many, a, b, 0), 16u);
  EXPECT_EQ(make_cpu_engine(scene, two)->most_together(a, b), 1u);
  b.settings.beam_count *= 3;
  EXPECT_EQ(most(many, a, b), 1u) << "the small ping would wait for the large one";
  b = a;
  b.switches.fixed_fan = 40;
  EXPECT_EQ(most(many, a, b), 1u) << "the CPU computes it";
  b = a;
  b.switches.multipath = true;
  EXPECT_EQ(most(many, a, b), 1u);
}

TEST(DeferringDevice, RunsACallWhileOthersAreSubmitted) {
  const auto scene = basin();
  const std::vector<PingRequest> all = requests();
  const std::span<const PingRequest> first(all.data(), 2), second(all.data() + 2, 3);
  Parallel pool(1);
  const auto engine = cuda::make_device_engine(scene, pool, {.simd = SimdLevel::portable}, std::make_unique<DeferringMachine>(),
                                               {.batch = 2, .cpu_after_failure = false});
  PingRequest wrong = all[0];
  wrong.settings.beam_count = 0;
  engine->submit(first);
  engine->submit({&wrong, 1});
  const std::vector<Ping> between = engine->run(second);
  engine->submit(second);
  const std::vector<Ping> collected = engine->collect();
  EXPECT_THROW(engine->collect(), std::invalid_argument);
  EXPECT_THROW(engine->run({&wrong, 1}), std::invalid_argument);
  expect_same(between, engine->collect());
  expect_same(collected, engine->run(first));
}

}  // namespace
}  // namespace sonar::test
