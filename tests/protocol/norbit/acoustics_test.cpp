// Bathymetry of a Norbit over a known floor and a ball, through the whole engine.
#include <cmath>

#include "core/base/geometry.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/protocol/norbit/norbit_testing.hpp"

namespace sonar::norbit {
namespace {

using namespace tests;
using namespace sonar::test;

/// Looks ahead, as the engine's tests do: port is +y.
Bathymetry bathymetry_of(std::shared_ptr<const Scene> scene) {
  const protocol::DeviceState state = device();
  const Settings settings{.power = true, .stop_m = 6};
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
    int points = 0;
    for (const Beam& beam : seen.beams) {
      if (beam.sample == 0) continue;
      ++points;
      EXPECT_NEAR(deg_from_rad(static_cast<double>(beam.angle_rad)), -degrees, 1.0);
      EXPECT_NEAR(seen.range_m(beam), 2.95, 0.04);
    }
    EXPECT_GE(points, 1) << degrees;
    EXPECT_LE(points, 4) << degrees;
  }
}

}  // namespace
}  // namespace sonar::norbit
