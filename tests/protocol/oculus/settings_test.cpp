// Tests the rules that convert a fire message to PingSettings: rows, rates, gain, gamma, limits, sound speed, sample formats.
#include "protocol/oculus/settings.hpp"

#include <limits>

#include "core/sonar/water.hpp"
#include "tests/protocol/oculus/oculus_testing.hpp"

namespace sonar::oculus::tests {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

PingSettings settings_of(const FireRequest& request, const protocol::DeviceState& state) {
  return resolve(request, state).settings;
}

// The captured ping has, for 2.0 m at 1490.658551265436 m/s, 703 rows of 2.8421889710794315 mm.
TEST(RowGrid, IsTheCapturedOne) {
  const RowGrid grid = row_grid(2.0, 1490.658551265436);
  EXPECT_EQ(grid.count, 703);
  EXPECT_DOUBLE_EQ(grid.spacing_m, 0.0028421889710794315);
}

// For the captured request, the spacing in the packet is equal to the captured one in every bit.
TEST(RowGrid, SpacingReachesThePacketUnrounded) {
  FireRequest request = fire(0, 2, PingRate{195}, 0x19, 2, 50);
  request.settings.sound_speed_mps = 1490.658551265436;
  EXPECT_EQ(answer(device(), request).head.fixed.range_resolution_m, 0.0028421889710794315);
}

TEST(RowGrid, SpacingDoublesUntilTheRowsFit) {
  EXPECT_EQ(row_grid(10, 1500).count, 437);  // 2^3
  EXPECT_EQ(row_grid(30, 1500).count, 655);  // 2^4
  const double base = 1500 / (2 * row_rate_hz);
  for (double range = 0.1; range < 200; range *= 1.07) {
    const RowGrid grid = row_grid(range, 1500);
    const double doublings = std::log2(grid.spacing_m / base);
    EXPECT_NEAR(doublings, std::round(doublings), 1e-9);
    EXPECT_LE(grid.count, 720) << range;
    if (doublings > 0.5) {
      EXPECT_GT(range / (grid.spacing_m / 2), 720) << range << ": a finer spacing would fit";
    }
    EXPECT_LE(std::abs(range - grid.count * grid.spacing_m), grid.spacing_m) << "the rows end within one row of the range";
  }
}

TEST(RowGrid, HasAtLeastOneRow) { EXPECT_EQ(row_grid(0.001, 1500).count, 1); }

TEST(Laws, RatesAreThoseOfTheTable) {
  EXPECT_EQ(table_rate_hz(PingRate{0}), 10);
  EXPECT_EQ(table_rate_hz(PingRate{1}), 15);
  EXPECT_EQ(table_rate_hz(PingRate{2}), 40);
  EXPECT_EQ(table_rate_hz(PingRate{3}), 5);
  EXPECT_EQ(table_rate_hz(PingRate{4}), 2);
  EXPECT_EQ(table_rate_hz(PingRate{5}), 0);
  EXPECT_EQ(table_rate_hz(PingRate{6}), 10);
  EXPECT_EQ(table_rate_hz(PingRate{195}), 10);
}

TEST(Laws, GammaFollowsTheByte) {
  EXPECT_EQ(gamma_from_byte(0), 1);
  EXPECT_EQ(gamma_from_byte(255), 1);
  EXPECT_NEAR(gamma_from_byte(127), 0.5, 0.003);
}

TEST(Laws, GainEchoFollowsModeFlagsAndOption) {
  const auto echo = [](int mode, int flags, double gain, const char* option) {
    return echoed_gain_percent(fire(0, mode, PingRate::hz10, flags, 5, gain).settings, option);
  };
  EXPECT_DOUBLE_EQ(echo(2, 0x0D, 50, "auto"), 70);  // ENS inverts 40 + 0.6 g in mode 2
  EXPECT_DOUBLE_EQ(echo(2, 0x1D, 50, "auto"), 50);  // BLU expects the gain verbatim; the capture has flags 0x19 and gain 50
  EXPECT_DOUBLE_EQ(echo(1, 0x0D, 50, "auto"), 50);
  EXPECT_DOUBLE_EQ(echo(2, 0x0D, 50, "verbatim"), 50);
  EXPECT_DOUBLE_EQ(echo(2, 0x1D, 50, "mapped"), 70);
  EXPECT_DOUBLE_EQ(echo(1, 0x1D, 50, "mapped"), 50);
}

TEST(Settle, ModesAndRangesAreApplied) {
  const auto state = device();
  const PingSettings high = settings_of(fire(0, 2, PingRate::hz40, 0x49, 5, 50), state);
  EXPECT_EQ(high.mode, 1);
  EXPECT_EQ(high.range_m, 5);
  EXPECT_EQ(high.beam_count, 512);
  EXPECT_EQ(high.rate_hz, 40);
  EXPECT_FALSE(high.triggered);
  const PingSettings per_cent = settings_of(fire(1, 1, PingRate::hz15, 0x00, 20, 50), state);
  EXPECT_EQ(per_cent.mode, 0);
  EXPECT_DOUBLE_EQ(per_cent.range_m, 8) << "the range is 20 per cent of 40 m";
  EXPECT_EQ(per_cent.beam_count, 256);
}

TEST(Settle, GainIsDecibelsPerEffectivePerCent) {
  const auto state = device();
  EXPECT_FLOAT_EQ(settings_of(fire(0, 1, PingRate::hz10, 0x49, 5, 50), state).gain_db, 48);
  EXPECT_NEAR(settings_of(fire(0, 2, PingRate::hz10, 0x49, 5, 50), state).gain_db, 0.96 * 70, 1e-4);
  EXPECT_FLOAT_EQ(settings_of(fire(0, 2, PingRate::hz10, 0x59, 5, 50), state).gain_db, 48);
}

TEST(Settle, ClampsValuesOutOfRangeWithANotice) {
  const auto state = device();
  const ResolvedSettings far = resolve(fire(0, 2, PingRate::hz10, 0x49, 20, 150), state);
  EXPECT_EQ(far.settings.range_m, 10);
  EXPECT_NEAR(far.settings.gain_db, 96, 1e-4) << "the gain of 100 per cent";
  EXPECT_THAT(far.clamped,
              ElementsAre("range 20 m is outside 0.1..10 m, 10 m is used", "gain 150 % is outside 0..100 %, 100 % is used"));
  const ResolvedSettings near = resolve(fire(0, 1, PingRate::hz10, 0x49, -3, -5), state);
  EXPECT_NEAR(near.settings.range_m, 0.1, 1e-8);
  EXPECT_EQ(near.settings.gain_db, 0);
  EXPECT_NEAR(settings_of(fire(0, 1, PingRate::hz10, 0x49, 0, 0), device("oculus-m370s")).range_m, 0.2, 1e-7);
  for (const int mode : {0, 3, 255}) {
    const ResolvedSettings odd = resolve(fire(0, mode, PingRate{9}, 0x49, 5, 50), state);
    EXPECT_EQ(odd.settings.mode, 0);
    EXPECT_EQ(odd.settings.rate_hz, 10);
    EXPECT_EQ(odd.clamped.size(), 2u);
  }
  EXPECT_EQ(resolve(fire(0, 2, PingRate::hz10, 0x49, 5, 50), device("oculus-m370s")).settings.mode, 0)
      << "an M370s has only one mode";
  FireRequest odd_water = fire(0, 1, PingRate::hz10, 0x49, 5, 50);
  odd_water.settings.sound_speed_mps = 1e6;
  odd_water.settings.salinity_ppt = -4;
  EXPECT_EQ(settings_of(odd_water, state).device_sound_speed_mps, 1700);
}

TEST(Settle, EveryFiniteMessageGivesUsableSettings) {
  const auto state = device();
  const double values[] = {0, -1, 1e-300, 1e300, -1e300, 1, 100, 1e6, std::numeric_limits<double>::denorm_min()};
  for (const double value : values) {
    for (int flags = 0; flags < 256; flags += 13) {
      FireRequest request = fire(2, flags % 4, static_cast<PingRate>(flags % 8), flags, value, value);
      request.settings.sound_speed_mps = request.settings.salinity_ppt = value;
      const PingSettings s = settings_of(request, state);
      EXPECT_GE(s.range_m, static_cast<double>(0.1f));
      EXPECT_LE(s.range_m, 40);
      EXPECT_GE(s.range_bin_count, 1);
      EXPECT_LE(s.range_bin_count, 720);
      EXPECT_GE(s.gain_db, 0);
      EXPECT_LE(s.gain_db, 96.001f);
      EXPECT_GE(s.device_sound_speed_mps, 1300);
      EXPECT_LE(s.device_sound_speed_mps, 1700);
      EXPECT_GE(s.rate_hz, 0);
      EXPECT_LE(s.rate_hz, 40);
      EXPECT_TRUE(std::isfinite(s.device_absorption_db_per_m));
    }
  }
}

TEST(Settle, NotANumberIsNoticed) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, infinity, -infinity}) {
    FireSettings settings;
    EXPECT_FALSE(has_non_finite(settings));
    for (double FireSettings::*field :
         {&FireSettings::range, &FireSettings::gain_percent, &FireSettings::sound_speed_mps, &FireSettings::salinity_ppt}) {
      FireSettings broken = settings;
      broken.*field = bad;
      EXPECT_TRUE(has_non_finite(broken));
    }
  }
}

TEST(Settle, DeviceComputesItsSoundSpeed) {
  auto state = device();
  state.water = Water{20, 35, 8, 1234};  // the device does not use the sound speed of the world
  state.depth_m = 0;
  FireRequest request = fire(0, 1, PingRate::hz10, 0x49, 5, 50);
  EXPECT_NEAR(settings_of(request, state).device_sound_speed_mps, sound_speed_unesco_mps(20, 0, 0), 0.01);
  request.settings.salinity_ppt = 35;
  EXPECT_NEAR(settings_of(request, state).device_sound_speed_mps, sound_speed_unesco_mps(20, 35, 0), 0.01);
  EXPECT_NEAR(settings_of(request, state).device_absorption_db_per_m, absorption_db_per_m(Water{20, 35, 8, 0}, 0, 1.2e6), 1e-6);
  state.depth_m = 100;
  EXPECT_NEAR(settings_of(request, state).device_sound_speed_mps, sound_speed_unesco_mps(20, 35, 10.05), 0.03);
  request.settings.sound_speed_mps = 1480;
  EXPECT_EQ(settings_of(request, state).device_sound_speed_mps, 1480);
}

TEST(Settle, SampleFormatsFollowTheFlags) {
  const auto state = device();
  const SampleFormat eight = settings_of(fire(0, 1, PingRate::hz10, 0x49, 5, 50), state).format;
  EXPECT_EQ(eight.bits, 8);
  EXPECT_EQ(eight.max_code, 254u);
  EXPECT_FALSE(eight.row_gains);
  const SampleFormat sixteen = settings_of(fire(0, 1, PingRate::hz10, 0x4F, 5, 50), state).format;
  EXPECT_EQ(sixteen.bits, 16);
  EXPECT_EQ(sixteen.max_code, 65535u);
  EXPECT_TRUE(sixteen.row_gains);
}

// liboculus issue 13: analogue and digital TVG are off, and a gain of 0 to 100 % is 0 to 96 dB.
TEST(Settle, ScientificDataHas32Bits) {
  const auto state = device();
  FireRequest request = fire(2, 2, PingRate::hz10, 0x4F, 4, 50);
  request.extension.flags = 0x200;
  const PingSettings s = settings_of(request, state);
  EXPECT_EQ(s.format.bits, 32);
  EXPECT_EQ(s.format.max_code, 0xFFFFFFFFu);
  EXPECT_FALSE(s.tvg);
  EXPECT_FLOAT_EQ(s.gain_db, 48);
  request.version = 1;  // a message of version 1 has no extension
  EXPECT_EQ(settings_of(request, state).format.bits, 16);
}

TEST(Settle, RateLeavesTimeForTheLastEcho) {
  auto state = device("oculus-m750d");
  FireRequest request = fire(0, 1, PingRate::hz40, 0x49, 120, 50);
  request.settings.sound_speed_mps = 1500;
  EXPECT_NEAR(settings_of(request, state).rate_hz, 1 / 0.162, 1e-3);
  request.settings.ping_rate = PingRate::standby;
  EXPECT_EQ(settings_of(request, state).rate_hz, 0);
}

TEST(Settle, NetworkSpeedAppliesOnlyIfConfigured) {
  FireRequest request = fire(0, 2, PingRate::hz40, 0x49, 2, 50);
  request.settings.network_speed = 10;
  EXPECT_EQ(settings_of(request, device()).rate_hz, 40);
  const auto state = device("oculus-m1200d", {{"honour_network_speed", "true"}});
  const PingSettings slowed = settings_of(request, state);
  EXPECT_NEAR(slowed.rate_hz * static_cast<double>(ping_size(slowed)) * 8, 10e6, 10);
  request.settings.network_speed = 255;
  EXPECT_EQ(settings_of(request, state).rate_hz, 40);
}

TEST(Settle, PulseFollowsTheRows) {
  const FireRequest request = fire(0, 2, PingRate::hz10, 0x49, 10, 50);
  const PingSettings rows = settings_of(request, device());
  EXPECT_FLOAT_EQ(rows.pulse_width_m, static_cast<float>(0.71 * rows.range_bin_m));
  EXPECT_EQ(rows.samples_per_row, 1);
  const PingSettings native = settings_of(request, device("oculus-m1200d", {{"pulse", "native"}}));
  EXPECT_FLOAT_EQ(native.pulse_width_m, 0.0025f);
  EXPECT_EQ(native.samples_per_row, 22) << "rows of 22.9 mm have samples of 1.06 mm (F_s = 2b)";
}

TEST(Settle, OnlyTheRecordedModeHasTheRecordedPulse) {
  const auto rows_of = [](const char* profile, std::uint8_t mode) {
    const PingSettings s = settings_of(fire(0, mode, PingRate::hz10, 0x49, 3, 50), device(profile));
    return static_cast<double>(s.pulse_width_m) / s.range_bin_m;
  };
  EXPECT_NEAR(rows_of("oculus-m1200d", 2), 0.71, 1e-6);
  EXPECT_NEAR(rows_of("oculus-mf1200d", 2), 0.71, 1e-6) << "this product has the same electronics";
  for (const auto& [profile, mode] :
       {std::pair("oculus-m1200d", 1), {"oculus-m750d", 2}, {"oculus-m3000d", 2}, {"oculus-n1200s", 1}})
    EXPECT_NEAR(rows_of(profile, static_cast<std::uint8_t>(mode)), 0.9, 1e-6) << profile;
}

/// A shorter pulse would halve the width of the surface cells and double the time of a ping (`recorded_pulse_rows`).
TEST(Settle, RecordedPulseHasCellsAsWideAsTheUsualOne) {
  for (const double sound_speed_mps : {1447.0, 1475.0, 1500.0, 1550.0}) {
    FireRequest request = fire(0, 2, PingRate::hz10, 0x49, 2, 50);
    request.settings.sound_speed_mps = sound_speed_mps;
    const PingSettings s = settings_of(request, device());
    const auto cell_m = [](double pulse_m) { return std::exp2(std::floor(std::log2(pulse_m))); };
    EXPECT_EQ(cell_m(static_cast<double>(s.pulse_width_m)), cell_m(0.9 * s.range_bin_m)) << sound_speed_mps;
  }
}

TEST(Settle, NativePulseHasAtMost32SamplesPerRow) {
  const FireRequest request = fire(0, 1, PingRate::hz10, 0x49, 200, 50);
  const PingSettings native = settings_of(request, device("oculus-m370s", {{"pulse", "native"}}));
  EXPECT_EQ(native.samples_per_row, 32);
  EXPECT_NEAR(static_cast<double>(native.pulse_width_m), native.range_bin_m / 32 * 4 * 0.5887, 1e-4);
}

TEST(Settle, RowRateIsAnOption) {
  const FireRequest request = fire(0, 2, PingRate::hz10, 0x49, 2, 50);
  const PingSettings fast = settings_of(request, device("oculus-m1200d", {{"row_rate_hz", "131118.881"}}));
  EXPECT_EQ(fast.range_bin_count, settings_of(request, device()).range_bin_count / 2);
}

TEST(Settle, RowOriginIsAnOption) {
  const FireRequest request = fire(0, 2, PingRate::hz10, 0x49, 2, 50);
  EXPECT_EQ(settings_of(request, device()).row_centre, 0.5);
  EXPECT_EQ(settings_of(request, device("oculus-m1200d", {{"row_origin", "near_edge"}})).row_centre, 0);
  EXPECT_EQ(settings_of(request, device("oculus-m1200d", {{"row_origin", "far_edge"}})).row_centre, 1);
}

TEST(Settle, TheLowestAndHighestRowRatesAreUsable) {
  for (const char* rate : {"1e4", "1e7"}) {
    const PingSettings s = settings_of(fire(0, 2, PingRate::hz10, 0x49, 2, 50), device("oculus-m1200d", {{"row_rate_hz", rate}}));
    EXPECT_TRUE(s.range_bin_m > 0 && s.range_bin_m < 1) << rate;
    EXPECT_TRUE(s.range_bin_count >= 1 && s.range_bin_count <= 720) << rate;
  }
}

TEST(Settle, NetworkTriggerIsApplied) { EXPECT_TRUE(settings_of(fire(0, 1, PingRate::hz10, 0xC9, 5, 50), device()).triggered); }

}  // namespace
}  // namespace sonar::oculus::tests
