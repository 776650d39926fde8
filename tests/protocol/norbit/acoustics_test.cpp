// Tests the bathymetry of a Norbit over a known floor and a ball, computed with the whole engine.
#include <algorithm>
#include <cmath>

#include "core/base/geometry.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/protocol/norbit/norbit_testing.hpp"

namespace sonar::norbit {
namespace {

using namespace tests;
using namespace sonar::test;

/// Returns the bathymetry of a ping of this scene. As in the engine's tests, the sonar looks ahead and port is +y.
Bathymetry bathymetry_of(std::shared_ptr<const Scene> scene) {
  const protocol::DeviceState state = device();
  const Settings settings{.power = 1, .stop_m = 6};
  Sounding sounding(std::move(scene), models().front()->modes[0], ping_settings(settings, state));
  sounding.request.water = state.water;
  sounding.request.model = state.model;
  sounding.request.vendor_settings = std::make_shared<HeldSettings>(settings);
  return *read_bathymetry(encode_bathymetry(sounding.ping_from({}), state));
}

TEST(NorbitAcoustics, PortIsNegativeAndRangesAreTrue) {
  for (const double degrees : {-40.0, 0.0, 25.0}) {
    const double azimuth = rad_from_deg(degrees);
    const auto seen =
        bathymetry_of(SceneMaker().add(sphere(0.05, 4), -10, {3 * std::cos(azimuth), 3 * std::sin(azimuth), 0}).make());
    const auto brightest = std::max_element(seen.beams.begin(), seen.beams.end(),
                                            [](const Beam& a, const Beam& b) { return a.intensity < b.intensity; });
    EXPECT_EQ(brightest->quality_flag, 3);
    EXPECT_NEAR(deg_from_rad(static_cast<double>(brightest->angle_rad)), -degrees, 0.8) << "a ball is 1.9 degrees wide";
    EXPECT_NEAR(seen.range_m(*brightest), 2.95, 0.02);
    const auto points = std::count_if(seen.beams.begin(), seen.beams.end(), [](const Beam& beam) { return beam.sample > 0; });
    EXPECT_LE(points, 8) << "directions without an echo have no bottom";
  }
}

}  // namespace
}  // namespace sonar::norbit
