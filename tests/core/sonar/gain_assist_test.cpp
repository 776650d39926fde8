// Gain assist: the rule compared with its closed form, and the state that a device keeps from ping to ping.
#include "core/sonar/gain_assist.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace sonar {
namespace {

using std::chrono::milliseconds;

Ping picture(double loud_share, std::uint32_t loud_code, int bits = 8, std::uint32_t max_code = 254) {
  Ping ping;
  ping.request.settings.gain_assist = true;
  ping.request.settings.format = {.bits = bits, .max_code = max_code, .gamma = 1, .row_gains = false};
  constexpr int count = 10000;
  for (int i = 0; i < count; ++i) {
    const std::uint32_t code = i < loud_share * count ? loud_code : 3;
    for (int b = 0; b < bits / 8; ++b) ping.samples.push_back(static_cast<std::byte>(code >> (8 * b) & 0xFFu));
  }
  return ping;
}

TEST(GainAssist, PercentileIsFoundForEverySampleSize) {
  EXPECT_NEAR(percentile_of_full_scale(picture(0.02, 127)), 0.5, 1e-6);
  EXPECT_NEAR(percentile_of_full_scale(picture(0.005, 127)), 3.0 / 254, 1e-6);
  EXPECT_NEAR(percentile_of_full_scale(picture(0.02, 32768, 16, 65535)), 0.5, 1e-4);
  EXPECT_NEAR(percentile_of_full_scale(picture(0.02, 0x80000000u, 32, 0xFFFFFFFFu)), 0.5, 1e-4);
  EXPECT_EQ(percentile_of_full_scale(picture(1, 254)), 1);
}

TEST(GainAssist, ApproachesWithItsTimeConstant) {
  // 6 dB below the wanted level (in amplitude). After one time constant, 63 % of this difference has been corrected.
  EXPECT_NEAR(next_gain_db(40, assisted_level / 2, 1, 0.3), 40 + (1 - std::exp(-1.0)) * 20 * std::log10(2.0), 1e-9);
  EXPECT_NEAR(next_gain_db(40, assisted_level, 1, 0.1), 40, 1e-9);
  EXPECT_NEAR(next_gain_db(40, assisted_level / 2, 0.5, 100), 40 + 40 * std::log10(2.0), 1e-9)
      << "the exponent 0.5 halves the decibels of a sample";
  EXPECT_EQ(next_gain_db(40, assisted_level / 2, 1, 0), 40);
  EXPECT_EQ(next_gain_db(95, 0, 1, 10), most_assisted_gain_db);
  EXPECT_EQ(next_gain_db(1, 1, 1, 10), least_assisted_gain_db);
  EXPECT_LT(next_gain_db(40, 1, 1, 10), 30) << "a saturated picture does not say how far it is over";
}

/// Returns the gain after `pings` pings, one per `period`. At gain 0 dB the 99th percentile is the part `scene` of full scale.
double settled_gain_db(double scene, double gamma, float from_db, int pings, milliseconds period) {
  GainAssist assist;
  PingSettings settings;
  settings.gain_assist = true;
  settings.gain_db = from_db;
  settings.format.gamma = static_cast<float>(gamma);
  double gain = 0;
  for (int i = 0; i < pings; ++i) {
    gain = static_cast<double>(assist.gain_db(settings, Time{} + i * period));
    const double v = std::min(1.0, std::pow(scene * std::pow(10, gain / 20), gamma));
    Ping ping = picture(0.02, static_cast<std::uint32_t>(std::lround(v * 65535)), 16, 65535);
    ping.request.settings.mode = settings.mode;
    ping.request.settings.format.gamma = settings.format.gamma;
    ping.request.fired_at = Time{} + i * period;
    assist.look_at(ping);
  }
  return gain;
}

TEST(GainAssist, IsOffForLogarithmicSamples) {
  GainAssist assist;
  Ping loud = picture(1, 254);
  PingSettings& settings = loud.request.settings;
  settings.format.scale = SampleFormat::Scale::logarithmic;
  settings.gain_db = 40;
  EXPECT_EQ(assist.gain_db(settings, Time{}), 40);
  assist.look_at(loud);
  EXPECT_EQ(assist.gain_db(settings, Time{} + milliseconds(500)), 40);
}

TEST(GainAssist, SettlesWhereTheLoudPartIsJustBelowFullScale) {
  for (const double gamma : {1.0, 0.5})
    for (const float from_db : {0.0f, 30.0f, 90.0f}) {
      const double wanted = 20 * std::log10(std::pow(assisted_level, 1 / gamma) / 1e-2);
      EXPECT_NEAR(settled_gain_db(1e-2, gamma, from_db, 100, milliseconds(100)), wanted, 0.1) << gamma << " " << from_db;
    }
}

/// A scene that becomes louder by 3 dB per second. The gain follows without steps, and the picture saturates only occasionally.
TEST(GainAssist, FollowsAGrowingSceneWithoutSteps) {
  for (const double gamma : {1.0, 0.5}) {
    GainAssist assist;
    PingSettings settings;
    settings.gain_assist = true;
    settings.gain_db = 40;
    settings.format.gamma = static_cast<float>(gamma);
    double before = 40, largest_step = 0;
    for (int i = 0; i < 300; ++i) {
      const Time at = Time{} + i * milliseconds(100);
      const auto gain = static_cast<double>(assist.gain_db(settings, at));
      if (i > 50) largest_step = std::max(largest_step, std::abs(gain - before));
      before = gain;
      const double level_db = gain - 40 - 10 + 0.3 * i;  // level of the loud part, re full scale
      const double v = std::min(1.0, std::pow(std::pow(10, level_db / 20), gamma));
      Ping ping = picture(0.02, static_cast<std::uint32_t>(std::lround(v * 65535)), 16, 65535);
      ping.request.settings.format.gamma = settings.format.gamma;
      ping.request.fired_at = at;
      assist.look_at(ping);
    }
    EXPECT_LT(largest_step, 1.5) << gamma;
    EXPECT_GT(largest_step, 0) << gamma;
  }
}

TEST(GainAssist, BelongsToItsModeAndLeavesOthersAlone) {
  GainAssist assist;
  PingSettings settings;
  settings.gain_db = 48;
  EXPECT_EQ(assist.gain_db(settings, Time{}), 48) << "off";
  assist.look_at(picture(1, 254));
  EXPECT_EQ(assist.gain_db(settings, Time{} + milliseconds(100)), 48);
  settings.gain_assist = true;
  EXPECT_EQ(assist.gain_db(settings, Time{} + milliseconds(200)), 48) << "starts from the client's gain";
  Ping loud = picture(1, 254);
  loud.request.fired_at = Time{} + milliseconds(200);
  assist.look_at(loud);
  EXPECT_LT(assist.gain_db(settings, Time{} + milliseconds(300)), 47.7);
  const float held = assist.gain_db(settings, Time{} + milliseconds(400));
  EXPECT_EQ(assist.gain_db(settings, Time{} + milliseconds(900)), held) << "no new picture, no change";
  settings.mode = 1;
  EXPECT_EQ(assist.gain_db(settings, Time{} + milliseconds(1000)), 48) << "another mode starts anew";
}

}  // namespace
}  // namespace sonar
