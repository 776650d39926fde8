// The transmitter's leak, the pulses of other sonars and crosstalk, through the whole engine: their levels by definition, their
// positions, and no effect if they are switched off or not given.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <vector>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test::interference_test {
namespace {

double db(double power) { return 10 * std::log10(power); }

std::shared_ptr<const Scene> with_other_sonar(const Vec3d& position, float rate_hz, const SceneMaker& maker = {}) {
  Scene scene = *maker.make();
  scene.other_sonars.push_back(
      OtherSonar{.name = "neighbour", .position_m = position, .level_upa = 1e6f, .rate_hz = rate_hz, .pulse_s = 4e-4f});
  return std::make_shared<const Scene>(scene);
}

/// Puts a changed receiver into the request's model.
void give_receiver(Sounding& s, const ReceiverModel& law) {
  auto model = std::make_shared<SonarModel>(*s.request.model);
  model->modes[0].receiver = law;
  s.request.model = std::move(model);
}

double mean_row_power(const Sounding& s, int row) {
  double sum = 0;
  for (int j = 0; j < s.beams(); ++j) sum += s.power(row, j);
  return sum / s.beams();
}

ReceiverModel leaking() {
  ReceiverModel law;
  law.leak_upa = 1e8f;
  law.leak_decay_db_per_m = 60;
  return law;
}

TEST(Leak, FallsFromItsLevelByItsDecay) {
  Sounding s(SceneMaker().make(), oculus_high(), default_rows(2, 700));
  give_receiver(s, leaking());
  s.request.switches.expected_power = true;
  s.ping();
  for (const int row : {0, 3, 50, 200}) {
    const double expected = 160 - 60 * s.range_of_row(row);
    EXPECT_NEAR(db(mean_row_power(s, row)), expected, 0.1) << row;
  }
  EXPECT_EQ(s.power(699, 100), 0) << "the weak rest of the leak is dropped";
  // With speckle: the mean of many rows over beams and pings, each divided by its expected value.
  s.request.switches.expected_power = false;
  double ratio = 0;
  int n = 0;
  for (std::uint32_t ping = 1; ping <= 3; ++ping) {
    s.request.number = PingNumber{ping};
    s.request.seed = Seed{ping};
    s.ping();
    for (int row = 0; row < 400; row += 3, ++n)
      ratio += mean_row_power(s, row) / std::pow(10, (160 - 60 * s.range_of_row(row)) / 10);
  }
  EXPECT_NEAR(db(ratio / n), 0, 0.3);
}

TEST(Leak, ChangesLittleFromPingToPing) {
  Sounding s(SceneMaker().make(), oculus_high(), default_rows(2, 700));
  give_receiver(s, leaking());
  const auto first_rows = [&](std::uint32_t number) {
    s.request.number = PingNumber{number};
    s.ping();
    std::vector<double> all;
    for (int row = 0; row < 20; ++row)
      for (int j = 0; j < s.beams(); ++j) all.push_back(s.pressure(row, j));
    return all;
  };
  const std::vector<double> one = first_rows(1), two = first_rows(2);
  EXPECT_GT(correlation(one, two), 0.9);
  EXPECT_NE(one, two);
  s.request.seed = Seed{99};
  EXPECT_LT(std::abs(correlation(one, first_rows(1))), 0.2) << "another device of the same product";
}

TEST(Leak, IsSilentWhenOffOrNotGiven) {
  Sounding s(SceneMaker().make(), oculus_high(), default_rows(2, 700));
  s.ping();
  EXPECT_EQ(mean_row_power(s, 0), 0);
  give_receiver(s, leaking());
  s.request.switches.leak = false;
  s.ping();
  EXPECT_EQ(mean_row_power(s, 0), 0);
}

TEST(Leak, IsNotInABlankPing) {
  Sounding s(SceneMaker().make(), oculus_high(), default_rows(2, 700));
  give_receiver(s, leaking());
  s.request.blank = true;  // no scene, only noise; a sonar with its transmitter off pings in the same way
  s.ping();
  EXPECT_EQ(mean_row_power(s, 0), 0);
  s.request.switches.noise = true;
  const std::vector<float> noise = s.ping().pressure_upa;
  s.request.switches.leak = false;
  EXPECT_EQ(noise, s.ping().pressure_upa);
}

TEST(Leak, IsPresentThoughTheNoiseIsOffAndDoesNotChangeTheNoise) {
  Sounding s(SceneMaker().make(), oculus_high(), default_rows(2, 700));
  s.request.switches.noise = true;
  const std::vector<float> noise = s.ping().pressure_upa;
  give_receiver(s, leaking());
  const std::vector<float> both = s.ping().pressure_upa;
  EXPECT_NE(noise[0], both[0]);
  EXPECT_EQ(noise.back(), both.back());
}

TEST(Leak, RingsByItsTable) {
  ReceiverModel law = leaking();
  law.leak_ring_db = {0, -20, -5, -30};
  law.leak_ring_step_m = 0.1f;
  Sounding s(SceneMaker().make(), oculus_high(), default_rows(2, 700));
  give_receiver(s, law);
  s.request.switches.expected_power = true;
  s.ping();
  for (const int row : {0, 20, 35, 60, 90}) {
    const double at = s.range_of_row(row) / static_cast<double>(0.1f);
    const double expected = at < 1 ? -20 * at : at < 2 ? -20 + 15 * (at - 1) : -5 - 25 * (at - 2);
    EXPECT_NEAR(db(mean_row_power(s, row)), 160 + expected, 0.1) << row;
  }
  EXPECT_EQ(s.power(110, 100), 0) << "the interference is over";
  const std::vector<float> first = s.last().pressure_upa;
  ++s.request.sonar_id;
  EXPECT_EQ(s.ping().pressure_upa, first) << "in expected power interference is its mean, whatever the seed";
}

TEST(Leak, ContinuesAfterANullOfItsTable) {
  ReceiverModel law = leaking();
  law.leak_ring_db = {0, -300, -5, -30};
  law.leak_ring_step_m = 0.1f;
  Sounding s(SceneMaker().make(), oculus_high(), default_rows(2, 700));
  give_receiver(s, law);
  s.request.switches.expected_power = true;
  s.ping();
  const int row = static_cast<int>(s.row_of_range(0.2)) + 2;
  const double at = s.range_of_row(row) / static_cast<double>(0.1f);
  EXPECT_NEAR(db(mean_row_power(s, row)), 160 - 5 - 25 * (at - 2), 0.1);
}

/// Returns the record of a ping fired `after_s` after the epoch.
const Ping& ping_at(Sounding& s, double after_s) {
  s.request.fired_at = Time(std::chrono::nanoseconds(static_cast<std::int64_t>(after_s * 1e9)));
  return s.ping();
}

/// Fires every 2 ms until a pulse lies completely inside the record.
double find_streak(Sounding& s) {
  for (double t = 0; t < 0.4; t += 0.002) {
    ping_at(s, t);
    const auto& p = s.last().pressure_upa;
    const auto width = static_cast<std::size_t>(s.beams());
    const double total = std::accumulate(p.begin(), p.end(), 0.0);
    const auto sum_of_rows = [&](std::size_t from, std::size_t to) {
      return std::accumulate(p.begin() + static_cast<std::ptrdiff_t>(from * width),
                             p.begin() + static_cast<std::ptrdiff_t>(to * width), 0.0);
    };
    const auto rows = static_cast<std::size_t>(s.rows());
    if (total > 0 && sum_of_rows(0, 20) == 0 && sum_of_rows(rows - 200, rows) == 0) return t;
  }
  return -1;
}

TEST(Interference, IsAStreakOfItsPulseAtItsBearingAndLevel) {
  const double azimuth = rad_from_deg(12), range = 25;
  Sounding s(with_other_sonar({range * std::cos(azimuth), range * std::sin(azimuth), 0}, 7), oculus_high(), default_rows(5, 700));
  const double fired_s = find_streak(s);
  ASSERT_GE(fired_s, 0);
  const int beam = s.beam_at(azimuth);
  std::vector<int> loud;
  double top = 0;
  for (int row = 0; row < s.rows(); ++row) top = std::max(top, s.pressure(row, beam));
  for (int row = 0; row < s.rows(); ++row)
    if (s.pressure(row, beam) > 0.5 * top) loud.push_back(row);
  ASSERT_FALSE(loud.empty());
  EXPECT_EQ(loud.back() - loud.front() + 1, static_cast<int>(loud.size())) << "one streak";
  const double row_m = s.range_of_row(1) - s.range_of_row(0);
  EXPECT_NEAR(static_cast<double>(loud.size()) * row_m, 1500 * 4e-4 / 2, 2 * row_m) << "the streak is as long as the pulse";
  const int middle = (loud.front() + loud.back()) / 2;
  // One way: 1e6 uPa at 1 m over 25 m with absorption, in the beam that looks almost exactly at it.
  const double weight = receive_pattern(s.mode().pattern)(std::sin(azimuth) - s.beam_sine(beam));
  const double expected = 120 - 20 * std::log10(range) -
                          range * absorption_db_per_m(s.request.water, 0, static_cast<double>(s.mode().centre_hz)) +
                          20 * std::log10(weight);
  EXPECT_NEAR(db(s.power(middle, beam)), expected, 0.3);
  EXPECT_EQ(s.loudest_beam(middle), beam);
  // Side lobes: far from the sonar's direction, the level is that of the pattern, -30 dB and less.
  const int aside = s.beam_at(rad_from_deg(10.9));
  const double lobe = receive_pattern(s.mode().pattern)(std::sin(azimuth) - s.beam_sine(aside));
  EXPECT_NEAR(s.pressure(middle, aside), std::abs(lobe / weight) * s.pressure(middle, beam), 1e-3 * s.pressure(middle, beam));
  // If the ping is fired 100 us later, the pulse appears 100 us earlier.
  ping_at(s, fired_s + 1e-4);
  std::vector<int> later;
  for (int row = 0; row < s.rows(); ++row)
    if (s.pressure(row, beam) > 0.5 * top) later.push_back(row);
  ASSERT_FALSE(later.empty());
  EXPECT_NEAR((loud.front() - later.front()) * row_m, 1500 * 1e-4 / 2, 1.5 * row_m);
  // Its own rate: one period later the record is the same except for the phase.
  ping_at(s, fired_s + 1.0 / 7);
  EXPECT_NEAR(db(s.power(middle, beam)), expected, 0.3);
  // Expected power: the mean power instead of the tone.
  s.request.switches.expected_power = true;
  ping_at(s, fired_s);
  EXPECT_NEAR(db(s.power(middle, beam)), expected, 0.3);
}

TEST(Interference, IsNotBlurredByTheFocusOfItsRows) {
  const double azimuth = rad_from_deg(25), range = 25;
  Sounding s(with_other_sonar({range * std::cos(azimuth), range * std::sin(azimuth), 0}, 50), oculus_high(),
             default_rows(5, 700));
  ReceiverModel law;
  law.defocus = 1;
  give_receiver(s, law);
  double near = 0;
  for (double t = 0; t < 0.02; t += 3e-4) {  // shorter than the pulse
    s.request.switches.defocus = false;
    const std::vector<float> sharp = ping_at(s, t).pressure_upa;
    s.request.switches.defocus = true;
    EXPECT_EQ(ping_at(s, t).pressure_upa, sharp) << t;
    near += mean_row_power(s, 30);  // at 0.2 m
  }
  EXPECT_GT(near, 0);
}

TEST(Interference, IsSilentWhenOffBehindOrHidden) {
  const auto received = [](const std::shared_ptr<const Scene>& scene, bool on) {
    Sounding s(scene, oculus_high(), default_rows(5, 700));
    s.request.switches.interference = on;
    double sum = 0;
    for (double t = 0; t < 0.2; t += 0.004) {
      const auto& p = ping_at(s, t).pressure_upa;
      sum += std::accumulate(p.begin(), p.end(), 0.0);
    }
    return sum;
  };
  EXPECT_GT(received(with_other_sonar({8, 1, 0}, 50), true), 0);
  EXPECT_EQ(received(with_other_sonar({8, 1, 0}, 50), false), 0);
  EXPECT_EQ(received(with_other_sonar({-8, 1, 0}, 50), true), 0);
  SceneMaker wall_between;
  wall_between.add(wall(3, 3), -300, {7, 0, 0});
  EXPECT_LT(received(with_other_sonar({8, 1, 0}, 50, wall_between), true), 1);
}

ReceiverModel talking(float db) {
  ReceiverModel law;
  law.crosstalk_db = db;
  return law;
}

TEST(Crosstalk, PutsALoneEchoIntoAllBeamsAtItsLevel) {
  for (const int beam_count : {256, 512})
    for (const bool expected_power : {false, true}) {
      PingSettings settings = default_rows(5, 700);
      settings.beam_count = beam_count;
      Sounding s(SceneMaker().add_point({3, 0.2, 0}, -20).make(), oculus_high(), settings);
      s.request.switches.expected_power = expected_power;
      s.ping();
      const int row = s.loudest_row(s.beam_at(std::atan2(0.2, 3))), beam = s.loudest_beam(row);
      const double alone = db(s.power(row, beam)), far_before = db(s.power(row, 3) + 1e-30);
      EXPECT_LT(far_before, alone - 55);
      give_receiver(s, talking(-40));
      s.ping();
      // The nearest beam looks up to half a spacing past the point. This is corrected.
      const double off = receive_pattern(s.mode().pattern)(0.2 / std::hypot(3, 0.2) - s.beam_sine(beam));
      double mean = 0;
      for (int j = 0; j < 20; ++j) mean += s.power(row, j) / 20;
      EXPECT_NEAR(db(mean), alone - 20 * std::log10(off) - 40, 0.4) << beam_count << " " << expected_power;
    }
}

TEST(Crosstalk, OfADiffuseSceneHasTheTotalPowerForAnyNumberOfBeams) {
  // A wall all around, in expected power: every beam gets e^2 times the power of all columns.
  const auto added = [](int beam_count) {
    PingSettings settings = default_rows(5, 700);
    settings.beam_count = beam_count;
    Sounding s(SceneMaker().add(wall(6, 6), -20, {3, 0, 0}).make(), oculus_high(), settings);
    s.request.switches.expected_power = true;
    s.ping();
    const int row = static_cast<int>(s.row_of_range(3.1));  // the wall is at this range ahead; in that beam it is farther away
    const double before = s.power(row, 3);
    give_receiver(s, talking(-40));
    s.ping();
    return s.power(row, 3) - before;
  };
  EXPECT_NEAR(db(added(512) / added(256)), 0, 0.3);
}

TEST(Crosstalk, ChangesNothingWhenOffOrNotGiven) {
  Sounding s(SceneMaker().add(wall(6, 6), -20, {3, 0, 0}).make(), oculus_high(), default_rows(5, 700));
  const std::vector<float> plain = s.ping().pressure_upa;
  give_receiver(s, talking(-30));
  EXPECT_NE(s.ping().pressure_upa, plain);
  s.request.switches.crosstalk = false;
  EXPECT_EQ(s.ping().pressure_upa, plain);
}

}  // namespace
}  // namespace sonar::test::interference_test
