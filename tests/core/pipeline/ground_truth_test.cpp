// Data of a ping besides its picture: the first hit of every beam, and the complex signal from which the magnitudes are
// computed.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test {
namespace {

/// Returns a box to port at 4 m in front of a wall at 6 m. The wall covers only the port half.
std::shared_ptr<const Scene> box_before_half_a_wall() {
  return SceneMaker().add(box({0.5, 0.5, 3}), -20, {4.5, 1.5, 0}).add(wall(10, 10), -20, {6, 10, 0}).make();
}

TEST(Truth, EveryBeamHasItsFirstHit) {
  for (const int fan : {0, 100}) {
    Sounding s(box_before_half_a_wall(), p900(), native_rows(10, 0.0254));
    s.request.switches.keep_truth = true;
    s.request.switches.fixed_fan = fan;
    const Ping& ping = s.ping();
    ASSERT_EQ(ping.truth.size(), 512u);
    const auto at = [&](double azimuth_deg) {
      return ping.truth[static_cast<std::size_t>(s.beam_at(rad_from_deg(azimuth_deg)))];
    };
    EXPECT_EQ(at(20).object, 0u);
    EXPECT_NEAR(static_cast<double>(at(20).range_m), 4 / std::cos(rad_from_deg(20)), 0.05);
    EXPECT_EQ(at(5).object, 1u);
    EXPECT_NEAR(static_cast<double>(at(5).range_m), 6 / std::cos(rad_from_deg(5)), 0.05);
    EXPECT_EQ(at(-20).object, BeamTruth::nothing);
    EXPECT_EQ(at(-20).range_m, 0);
  }
}

TEST(Truth, IsOmittedWithoutARequest) {
  Sounding s(box_before_half_a_wall(), p900(), native_rows(8, 0.0254));
  const Ping& ping = s.ping();
  EXPECT_TRUE(ping.truth.empty());
  EXPECT_TRUE(ping.beam_signal_upa.empty());
}

TEST(BeamSignal, HasThePressuresAsItsMagnitude) {
  PingSettings settings = native_rows(8, 0.0254);
  settings.samples_per_row = 2;
  Sounding s(box_before_half_a_wall(), p900(), settings);
  s.request.switches.keep_beams = true;
  const Ping& ping = s.ping();
  const auto beams = static_cast<std::size_t>(s.beams()), rows = static_cast<std::size_t>(s.rows());
  ASSERT_EQ(ping.beam_signal_upa.size(), 2 * rows * beams);
  double largest = 0;
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t j = 0; j < beams; ++j) {
      const float power =
          std::norm(ping.beam_signal_upa[2 * row * beams + j]) + std::norm(ping.beam_signal_upa[(2 * row + 1) * beams + j]);
      const float pressure = ping.pressure_upa[row * beams + j];
      ASSERT_NEAR(std::sqrt(power / 2), pressure, 1e-4f * pressure + 1e-3f);
      largest = std::max(largest, static_cast<double>(pressure));
    }
  EXPECT_GT(largest, 1e6);
}

TEST(BeamSignal, DoesNotExistInExpectedPower) {
  Sounding s(box_before_half_a_wall(), p900(), native_rows(8, 0.0254));
  s.request.switches.keep_beams = s.request.switches.expected_power = true;
  EXPECT_TRUE(s.ping().beam_signal_upa.empty());
}

}  // namespace
}  // namespace sonar::test
