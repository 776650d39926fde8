// Pings that are computed between the parts of another ping. Both have the same bytes as without the interruption, for any
// bodies, settings and tiles. Also the allocations of a ping after the first.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>
#include <vector>

#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace {

thread_local std::size_t allocations = 0;

}  // namespace

// Counts every allocation of this program. (GCC mistakes the inlined pair for a mismatch.)
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size == 0 ? 1 : size)) return p;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size == 0 ? 1 : size);
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, const std::nothrow_t&) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace sonar::test {
namespace {

std::shared_ptr<const Scene> world() {
  SceneMaker maker;
  maker.add(height_field(-15, 15, -15, 15, 0.5, rough_relief(0.03, 12)), -20, {0, 0, -2});
  maker.add_body(box({0.4, 0.4, 0.4}), -12, {{4, 0.5, -1.5}, {}});
  return maker.make();
}

PingRequest seen_from(double y_m, double body_y_m, int number, const FrequencyMode& mode, const PingSettings& settings) {
  PingRequest r;
  auto model = std::make_shared<SonarModel>();
  model->modes = {mode};
  r.model = std::move(model);
  r.settings = settings;
  r.number = PingNumber{static_cast<std::uint32_t>(number)};
  r.seed = Seed{7};
  r.sonar_in_world = r.vehicle_in_world = {{0, y_m, 0}, quat_from_rpy({0, 0.25, 0})};
  r.bodies_in_world = {{{4, body_y_m, -1.5}, {}}};
  return r;
}

/// Runs the request as often as it is allowed.
class Other final : public Interruption {
 public:
  Other(PingEngine& engine, PingRequest request) : engine_(engine), request_(std::move(request)) {}
  bool expected() const override { return true; }
  void run_other() override { pings.push_back(engine_.run({&request_, 1}).at(0)); }
  std::vector<Ping> pings;

 private:
  PingEngine& engine_;
  PingRequest request_;
};

class Interrupted : public testing::TestWithParam<int> {};

TEST_P(Interrupted, PingsAreTheSameAsWithoutInterruption) {
  const auto scene = world();
  const PingRequest slow = seen_from(-1, 0.5, 3, p900(), default_rows(8, 400));
  const PingRequest quick = seen_from(2, -1.5, 9, oculus_high(), default_rows(4, 200));
  const auto alone = [&](const PingRequest& request) {
    Parallel pool(1);
    return make_cpu_engine(scene, pool)->run({&request, 1}).at(0).samples;
  };
  Parallel pool(GetParam());
  // The budget holds hardly one tile, so unused tiles are evicted immediately.
  const auto engine = make_cpu_engine(scene, pool, {.cell_cache_bytes = 1 << 12});
  Other other(*engine, quick);
  engine->set_interruption(&other);
  const Ping ping = engine->run({&slow, 1}).at(0);
  EXPECT_TRUE(ping.samples == alone(slow));
  ASSERT_GE(other.pings.size(), 2u) << "between groups of columns";
  for (const Ping& let_in : other.pings) EXPECT_TRUE(let_in.samples == alone(quick));
  engine->set_interruption(nullptr);
  EXPECT_TRUE(engine->run({&slow, 1}).at(0).samples == ping.samples);
}

INSTANTIATE_TEST_SUITE_P(Threads, Interrupted, testing::Values(1, 2, 3));

TEST(Heap, AWarmPingAllocatesLittleForAnyNumberOfCells) {
  const auto scene = world();
  Parallel pool(1);
  const auto engine = make_cpu_engine(scene, pool);
  const auto allocations_of = [&](const PingRequest& request) {
    std::size_t least = ~std::size_t{0};
    for (int k = 0; k < 4; ++k) {
      const std::size_t before = allocations;
      engine->run({&request, 1});
      least = std::min(least, allocations - before);
    }
    return least;
  };
  const std::size_t near = allocations_of(seen_from(0, 0.5, 1, p900(), default_rows(4, 160)));
  const std::size_t far = allocations_of(seen_from(0, 0.5, 1, p900(), default_rows(12, 480)));
  EXPECT_LE(far, 100u);
  EXPECT_LE(far, near + 4) << "nothing is allocated per cell, row or ray";
}

}  // namespace
}  // namespace sonar::test
