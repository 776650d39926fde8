// Threads of a device run in any order: whatever order host loops take, the bytes are the same, and no step reads what none has
// written.
#include <gtest/gtest.h>

#include <set>

#include "tests/core/pipeline/basin.hpp"
#include "tests/cuda/comparing.hpp"

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
      SonarModel wide = *request.model;  // a ninth of the cells
      wide.modes[0].pattern.azimuth_width_rad *= 3;
      request.model = std::make_shared<const SonarModel>(std::move(wide));
      all.push_back(std::move(request));
    }
  EXPECT_EQ(all.size(), wanted.size());
  return all;
}

std::vector<Ping> pings_in(LoopOrder order, const std::shared_ptr<const Scene>& scene, const std::vector<PingRequest>& all) {
  Parallel pool(1);
  const auto engine =
      cuda::make_device_engine(scene, pool, {.simd = SimdLevel::portable}, cuda::make_host_loops(order), {.batch = 3});
  return engine->run(all);
}

class AnyOrder : public ::testing::TestWithParam<LoopOrder> {};

TEST_P(AnyOrder, OfThreadsMakesTheSameBytes) {
  const auto scene = basin();
  const std::vector<PingRequest> all = requests();
  const auto there = pings_in(LoopOrder::forwards, scene, all), again = pings_in(GetParam(), scene, all);
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(there[i].samples, again[i].samples) << i;
    EXPECT_EQ(there[i].pressure_upa, again[i].pressure_upa) << i;
    EXPECT_EQ(there[i].beam_signal_upa, again[i].beam_signal_upa) << i;
    EXPECT_EQ(compare(there[i], again[i]).truth, true) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Orders, AnyOrder, ::testing::Values(LoopOrder::backwards, LoopOrder::scattered));

}  // namespace
}  // namespace sonar::test
