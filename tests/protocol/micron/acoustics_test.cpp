// Tests scan lines of a Micron with bodies at known positions, computed with the whole engine.
#include <algorithm>

#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/protocol/micron/micron_testing.hpp"

namespace sonar::micron {
namespace {

using namespace tests;
using namespace sonar::test;

struct Scanner {
  explicit Scanner(std::shared_ptr<const Scene> scene) {
    settings.command = sector();
    settings.command.gain = 60;
    sounding = std::make_unique<Sounding>(scene, models().front()->modes[0], ping_settings(settings, state));
    sounding->request.water = state.water;
  }
  std::vector<int> at(int bearing) {
    settings.bearing = static_cast<std::uint16_t>(bearing);
    const Ping& ping = sounding->ping_from({}, {0, 0, head_rad(settings)});
    std::vector<int> bins;
    for (const std::byte b : ping.samples) bins.push_back(std::to_integer<int>(b));
    return bins;
  }
  int brightest_bearing() {
    int best = 0, top = -1;
    for (int bearing = 0; bearing < 6400; bearing += 16) {
      const auto bins = at(bearing);
      if (const int most = *std::max_element(bins.begin(), bins.end()); most > top) top = most, best = bearing;
    }
    return best;
  }

  protocol::DeviceState state = device();
  Settings settings;
  std::unique_ptr<Sounding> sounding;
};

std::shared_ptr<const Scene> ball_at(Vec3d at) { return SceneMaker().add(sphere(0.03, 4), -10, at).make(); }

TEST(MicronAcoustics, PortAndStarboardAreNotSwapped) {
  EXPECT_NEAR(Scanner(ball_at({0, -1.2, 0})).brightest_bearing(), 4800, 16) << "a ball to starboard";
  EXPECT_NEAR(Scanner(ball_at({0, 1.2, 0})).brightest_bearing(), 1600, 16) << "a ball to port";
  EXPECT_NEAR(Scanner(ball_at({1.2, 0, 0})).brightest_bearing(), 3200, 16);
  EXPECT_NEAR(Scanner(ball_at({-1, 1, 0})).brightest_bearing(), 800, 16) << "a ball astern to port";
}

TEST(MicronAcoustics, ABallIsAtItsRange) {
  for (const double range_m : {0.6, 1.0, 1.7}) {
    const auto bins = Scanner(ball_at({range_m, 0, 0})).at(3200);
    const auto top = std::max_element(bins.begin(), bins.end()) - bins.begin();
    EXPECT_GT(bins[static_cast<std::size_t>(top)], 50);
    EXPECT_LT(bins[static_cast<std::size_t>(top)], 255) << "saturated";
    EXPECT_NEAR((static_cast<double>(top) + 0.5) * 20 * bin_unit_s * 750, range_m - 0.03, 0.015);
  }
}

}  // namespace
}  // namespace sonar::micron
