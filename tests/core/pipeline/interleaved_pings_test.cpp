// Pictures made of several pings: each beam equals that of its own ping, each ping has its own noise, and channels have gains.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "core/pipeline/ping_engine.hpp"
#include "core/pipeline/ping_scalars.hpp"
#include "core/sonar/ping.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test::interleaved_pings_test {
namespace {

constexpr int beams = 96, rows = 120, pings = 3;
constexpr double interval_s = 0.03;

/// Returns a sonar 2 m above a bed. The beams are as wide as their spacing.
Sounding over_bed(int interleaved, std::vector<float> channel_gain_db = {}) {
  FrequencyMode mode = p900();
  mode.interleaved_pings = interleaved;
  mode.receiver.channel_gain_db = std::move(channel_gain_db);
  PingSettings settings = default_rows(6, rows);
  settings.beam_count = beams;
  settings.ping_interval_s = interval_s;
  const Mesh bed = height_field(-1, 8, -8, 8, 1, [](double, double) { return 0.0; });
  Sounding s(SceneMaker().add(bed, -27).make(), mode, settings);
  s.request.sonar_in_world = {{0, 0, 2}, quat_from_rpy({0, 0.4, 0})};
  s.request.number = PingNumber{5};
  s.request.switches.interleave = true;
  s.request.fired_at = Time(std::chrono::seconds(100));
  s.request.switches.keep_beams = s.request.switches.keep_truth = s.request.switches.keep_labels = true;
  return s;
}

/// Returns the mean of s_j conj(s_j+1) divided by the mean power, for beams j equal to `of` modulo the number of pings.
double correlation_with_next(const Ping& ping, int of) {
  std::complex<double> sum = 0;
  double power = 0;
  for (int row = 0; row < rows; ++row)
    for (int j = of; j + 1 < beams; j += pings) {
      const std::complex<double> a = ping.beam_signal_upa[static_cast<std::size_t>(row * beams + j)],
                                 b = ping.beam_signal_upa[static_cast<std::size_t>(row * beams + j + 1)];
      sum += a * std::conj(b);
      power += (std::norm(a) + std::norm(b)) / 2;
    }
  return std::abs(sum) / power;
}

TEST(InterleavedPings, EachBeamEqualsThatOfItsOwnPing) {
  Sounding s = over_bed(pings), one = over_bed(1);
  s.request.switches.noise = one.request.switches.noise = true;
  s.request.sonar_moves = one.request.sonar_moves = {{0.8, 0.4, 0}, {0, 0, 0.3}};
  const Ping& picture = s.ping();
  EXPECT_EQ(picture.request.number, PingNumber{5});
  EXPECT_EQ(picture.request.fired_at, s.request.fired_at);
  EXPECT_EQ(picture.request.sonar_in_world.position_m.x, s.request.sonar_in_world.position_m.x);
  ASSERT_TRUE(picture.labels);
  const Pose start = one.request.sonar_in_world;
  for (int p = 0; p < pings; ++p) {
    one.request.sonar_in_world = propagate(start, one.request.sonar_moves, p * interval_s);
    one.request.number = PingNumber{5 * pings + static_cast<unsigned>(p)};
    const Ping& ping = one.ping();
    int equal = 0;
    for (int j = 0; j < beams; ++j) {
      const bool of_this_ping = (beams - 1 - j) % pings == p;
      if (of_this_ping) {
        EXPECT_EQ(picture.truth[static_cast<std::size_t>(j)].range_m, ping.truth[static_cast<std::size_t>(j)].range_m) << j;
      }
      bool same = true, same_labels = true;
      for (int row = 0; row < rows; ++row) {
        const auto i = static_cast<std::size_t>(row * beams + j);
        same &= picture.pressure_upa[i] == ping.pressure_upa[i] && picture.beam_signal_upa[i] == ping.beam_signal_upa[i] &&
                picture.samples[2 * i] == ping.samples[2 * i] && picture.samples[2 * i + 1] == ping.samples[2 * i + 1];
        same_labels &=
            picture.labels->instance[i] == ping.labels->instance[i] && picture.labels->share[i] == ping.labels->share[i];
      }
      EXPECT_EQ(same, of_this_ping) << "beam " << j << ", ping " << p;
      EXPECT_TRUE(same_labels || !of_this_ping) << "beam " << j << ", ping " << p;
      equal += same;
    }
    EXPECT_EQ(equal, beams / pings);
  }
}

/// Beams with different widths, from eight pings. Between the beams of one ping there are columns that none of them uses.
Sounding of_eight_pings(int threads) {
  FrequencyMode mode = p900();
  mode.interleaved_pings = 8;
  mode.beam_spacing = BeamSpacing::listed;
  mode.pattern.azimuth_taper = Taper::hann;
  for (int j = 0; j < beams; ++j) {
    const double x = 1 - (2.0 * j + 1) / beams;
    mode.beam_azimuths_rad.push_back(rad_from_deg(43 * x - 3 * x * x * x));
    mode.beam_widths_rad.push_back(static_cast<float>(rad_from_deg(86.0 / beams * (1 - 0.2 * x * x))));
  }
  PingSettings settings = default_rows(6, rows);
  settings.beam_count = beams;
  settings.ping_interval_s = interval_s;
  SceneMaker scene;
  scene.add(height_field(-1, 8, -8, 8, 1, [](double x, double) { return 0.1 * std::sin(3 * x); }), -27);
  scene.add(box({0.2, 0.2, 0.5}), -15, {4, 0.3, 0.5});
  Sounding s(scene.make(), mode, settings, {threads, {}});
  s.request.sonar_in_world = {{0, 0, 2}, quat_from_rpy({0, 0.4, 0})};
  s.request.sonar_moves = {{0.8, 0.4, 0}, {0, 0, 0.3}};
  s.request.switches.interleave = s.request.switches.noise = true;
  s.request.switches.keep_beams = s.request.switches.keep_truth = true;
  return s;
}

TEST(InterleavedPings, OmitColumnsThatTheirBeamsDoNotUse) {
  Sounding all = of_eight_pings(2);
  all.request.switches.keep_labels = true;  // labels belong to whole pings
  all.ping();
  for (const int threads : {1, 3}) {
    Sounding some = of_eight_pings(threads);
    some.ping();
    EXPECT_EQ(some.last().samples, all.last().samples);
    EXPECT_EQ(some.last().pressure_upa, all.last().pressure_upa);
    EXPECT_EQ(some.last().beam_signal_upa, all.last().beam_signal_upa);
    for (std::size_t j = 0; j < std::size_t{beams}; ++j)
      EXPECT_EQ(some.last().truth[j].range_m, all.last().truth[j].range_m) << j;
    EXPECT_LT(some.engine().statistics().echoes, all.engine().statistics().echoes / 2);
  }
}

/// A beam's band contains all of its energy except 1e-4. The beams of one ping have weights beyond this band.
TEST(InterleavedPings, BeamsOfTheFirstPingAreThoseOfOnePing) {
  Sounding s = of_eight_pings(2);
  s.request.switches.noise = false;
  const Ping picture = s.ping();
  s.request.switches.interleave = false;
  const Ping& one = s.ping();
  double error = 0, power = 0;
  for (std::size_t i = 0; i < picture.beam_signal_upa.size(); ++i) {
    if ((beams - 1 - static_cast<int>(i % beams)) % 8 != 0) continue;
    error += static_cast<double>(std::norm(picture.beam_signal_upa[i] - one.beam_signal_upa[i]));
    power += static_cast<double>(std::norm(one.beam_signal_upa[i]));
  }
  EXPECT_LT(error, 2e-4 * power);
  EXPECT_GT(error, 0);
}

TEST(InterleavedPings, EqualOnePingAtRestWithoutNoise) {
  Sounding s = over_bed(pings), one = over_bed(1);
  EXPECT_EQ(s.ping().samples, one.ping().samples);
}

TEST(InterleavedPings, NeighboursShareNoNoise) {
  Sounding s = over_bed(pings), one = over_bed(1);
  for (Sounding* each : {&s, &one}) {
    each->request.switches.noise = true;
    each->request.settings.transmit = false;
    each->request.blank = true;
    each->ping();
  }
  for (int of = 0; of < pings; ++of) {
    EXPECT_GT(correlation_with_next(one.last(), of), 0.25);
    EXPECT_LT(correlation_with_next(s.last(), of), 0.06);
  }
}

/// If a sonar passes over a bed, the speckle of the bed differs from ping to ping.
TEST(InterleavedPings, NeighboursShareNoSpeckleOnceTheSonarMoves) {
  Sounding s = over_bed(pings);
  s.ping();
  const double at_rest = correlation_with_next(s.last(), 0);
  s.request.sonar_moves.velocity_mps = {1, 0, 0};
  s.ping();
  EXPECT_GT(at_rest, 0.25);
  EXPECT_LT(correlation_with_next(s.last(), 0), 0.1);
  s.request.switches.motion = false;
  s.ping();
  EXPECT_DOUBLE_EQ(correlation_with_next(s.last(), 0), at_rest);
}

TEST(InterleavedPings, ChannelsHaveTheirGains) {
  const std::vector<float> gain_db{1, -2, 0.5f, 3};
  Sounding s = over_bed(1, gain_db), even = over_bed(1);
  for (Sounding* each : {&s, &even}) {
    each->request.switches.noise = true;
    each->request.settings.format = {.bits = 8,
                                     .max_code = 255,
                                     .scale = SampleFormat::Scale::logarithmic,
                                     .floor_db = -150,
                                     .ceiling_db = -22.5f};  // half a decibel per code
    each->ping();
  }
  EXPECT_EQ(s.last().pressure_upa, even.last().pressure_upa) << "gains do not change the pressure";
  int compared = 0, exact = 0;
  for (int row = 0; row < rows; ++row)
    for (int j = 0; j < beams; ++j) {
      const auto i = static_cast<std::size_t>(row * beams + j);
      const int with = std::to_integer<int>(s.last().samples[i]), without = std::to_integer<int>(even.last().samples[i]);
      if (without < 10 || without > 245) continue;
      const auto channel = static_cast<std::size_t>(j) * gain_db.size() / beams;
      ++compared;
      exact += with - without == static_cast<int>(2 * gain_db[channel]);
    }
  EXPECT_GT(compared, rows * beams / 2);
  EXPECT_GT(exact, 0.999 * compared);
  s.request.switches.uneven = false;
  EXPECT_EQ(s.ping().samples, even.last().samples);
}

TEST(InterleavedPings, ImpossibleOnesAreRefused) {
  Sounding s = over_bed(0);
  EXPECT_NE(why_invalid(s.request), "");
  Sounding late = over_bed(pings);
  late.request.settings.ping_interval_s = -1;
  EXPECT_NE(why_invalid(late.request), "");
  Sounding many = over_bed(7);  // the number of beams is not a multiple of this number
  EXPECT_EQ(why_invalid(many.request), "");
  EXPECT_EQ(many.ping().samples.size(), static_cast<std::size_t>(2 * rows * beams));
}

}  // namespace
}  // namespace sonar::test::interleaved_pings_test
