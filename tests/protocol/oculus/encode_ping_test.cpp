// Tests encoded pings: sizes, echo, version, environment, formats, bearings.
#include "protocol/oculus/models.hpp"
#include "tests/protocol/oculus/oculus_testing.hpp"

namespace sonar::oculus::tests {
namespace {

using ::testing::IsEmpty;

TEST(EncodePing, EveryFormatKeepsItsIdentities) {
  for (const int version : {0, 1, 2}) {
    for (const int flags : {0x09, 0x0B, 0x0D, 0x0F, 0x49, 0x4B, 0x4D, 0x4F}) {
      for (const std::uint32_t ext : {0u, 0x200u}) {
        FireRequest request = fire(version, 2, PingRate::hz10, flags, 3, 50);
        request.extension.flags = version == 2 ? ext : 0;
        const auto state = device();
        const PingSettings settings = resolve(request, state).settings;
        const DecodedPing ping = answer(state, request, 77);
        EXPECT_THAT(ping.violations, IsEmpty()) << version << " " << flags;
        EXPECT_THAT(echo_violations(request, ping), IsEmpty()) << version << " " << flags;
        EXPECT_EQ(ping.message.size(), ping_size(settings));
        EXPECT_EQ(ping.head.fixed.sizes.image_offset, 2048u);
        EXPECT_EQ(ping.head.fixed.ping_id, 77u);
        EXPECT_EQ(ping.rows(), static_cast<std::size_t>(settings.range_bin_count));
        EXPECT_EQ(ping.beams(), static_cast<std::size_t>(settings.beam_count));
        EXPECT_EQ(ping.row_gains.size(), settings.format.row_gains ? ping.rows() : 0u);
        EXPECT_EQ(ping.sample(5, 9) & 0xFF, (5 * 7 + 9) % 251);
        EXPECT_EQ(ping.bytes_per_sample() * 8, static_cast<std::size_t>(settings.format.bits));
      }
    }
  }
}

TEST(EncodePing, FillerIsZero) {
  const DecodedPing ping = answer(device(), fire(0, 2, PingRate::hz10, 0x09, 3, 50));
  for (std::size_t i = ping_v1_size + 512; i < 2048; ++i) ASSERT_EQ(ping.message[i], std::byte{0}) << i;
}

TEST(EncodePing, FullScaleStaysWithinARowOfTheEchoedRange) {
  for (double range = 0.3; range <= 10; range *= 1.3) {
    const DecodedPing ping = answer(device(), fire(0, 2, PingRate::hz10, 0x49, range, 50));
    const double resolution = ping.head.fixed.range_resolution_m;
    EXPECT_LE(std::abs(resolution * static_cast<double>(ping.rows()) - range), resolution * 1.0001);
  }
}

TEST(EncodePing, RangeIsEchoedVerbatimEvenWhenClamped) {
  const DecodedPing ping = answer(device(), fire(0, 2, PingRate::hz10, 0x49, 20, 50));
  EXPECT_EQ(ping.head.fixed.fire.range, 20);
  EXPECT_NEAR(ping.head.fixed.range_resolution_m * static_cast<double>(ping.rows()), 10, 0.05);
}

TEST(EncodePing, GainAssistFollowsTheFlagAndEchoesTheRequest) {
  const FireRequest set = fire(0, 2, PingRate::hz10, 0x19, 2, 50), clear = fire(0, 2, PingRate::hz10, 0x09, 2, 50);
  const auto assisted = [](const char* option, const FireRequest& request) {
    return resolve(request, device("oculus-m1200d", {{"gain_assist", option}})).settings.gain_assist;
  };
  EXPECT_TRUE(resolve(set, device()).settings.gain_assist) << "gain assist is the default, as in the capture";
  EXPECT_FALSE(resolve(clear, device()).settings.gain_assist);
  EXPECT_FALSE(assisted("off", set));
  EXPECT_FALSE(assisted("off", clear));
  EXPECT_TRUE(assisted("flag_set", set));
  EXPECT_FALSE(assisted("flag_set", clear));
  EXPECT_TRUE(assisted("flag_clear", clear));
  FireRequest scientific = fire(2, 2, PingRate::hz10, 0x19, 2, 50);
  scientific.extension.flags = flag::extended_32_bit;
  EXPECT_FALSE(assisted("flag_set", scientific));
  const auto echoed = [&](const char* gain_echo) {
    const auto state = device("oculus-m1200d", {{"gain_echo", gain_echo}});
    Ping ping = made_up_ping(state, resolve(set, state).settings);
    ping.request.settings.gain_db = 72;
    return decode_ping(encode_ping(ping, state, set)).value().head.fixed.fire.gain_percent;
  };
  EXPECT_EQ(echoed("auto"), 50) << "the capture has 50 % and flag bit 4";
  EXPECT_NEAR(echoed("used"), 75, 1e-5);
}

// FIL's M750d at 6 m and 50 %: row gains from 21 260 to 1 922 146.
TEST(EncodePing, RowGainsAreDigitalOrUndoTheTvg) {
  const FireRequest request = fire(0, 2, PingRate::hz10, 0x5D, 6, 50);
  const DecodedPing digital = answer(device("oculus-m750d"), request);
  EXPECT_NEAR(digital.row_gains.front(), 21260, 100);
  EXPECT_NEAR(10 * std::log10(digital.row_gains.back() / 1922146.0), 0, 1) << "dB";
  EXPECT_TRUE(std::is_sorted(digital.row_gains.begin(), digital.row_gains.end()));
  EXPECT_EQ(answer(device("oculus-m750d", {{"row_gain", "tvg"}}), request).row_gains[4], 5u) << "row gains are those of the ping";

  const DecodedPing none = answer(device(), fire(0, 1, PingRate::hz10, 0x4D, 6, 0));
  EXPECT_EQ(none.row_gains.front(), 1u) << "clients divide by the root of a row gain, so it is never 0";
  FireRequest scientific = fire(2, 1, PingRate::hz10, 0x4D, 6, 100);
  scientific.extension.flags = flag::extended_32_bit;
  for (const std::uint32_t gain : answer(device(), scientific).row_gains) EXPECT_NEAR(gain, 3.981e9, 1e6) << "96 dB";
}

TEST(EncodePing, GainEchoFollowsTheOption) {
  const FireRequest ens = fire(0, 2, PingRate::hz10, 0x0D, 2.54, 50), blu = fire(2, 2, PingRate::hz10, 0x1D, 2.54, 50);
  const auto gain = [](const char* option, const FireRequest& request) {
    return answer(device("oculus-m1200d", {{"gain_echo", option}}), request).head.fixed.fire.gain_percent;
  };
  EXPECT_DOUBLE_EQ(gain("auto", ens), 70);
  EXPECT_DOUBLE_EQ(gain("auto", blu), 50);
  EXPECT_DOUBLE_EQ(gain("verbatim", ens), 50);
  EXPECT_DOUBLE_EQ(gain("mapped", blu), 70);
}

TEST(EncodePing, AComputedSoundSpeedIsEchoedAsUsed) {
  FireRequest request = fire(0, 1, PingRate::hz10, 0x49, 5, 50);
  const DecodedPing computed = answer(device(), request);
  EXPECT_EQ(computed.head.fixed.fire.sound_speed_mps, computed.head.fixed.sound_speed_mps)
      << "both speeds are identical, as in the capture";
  EXPECT_NEAR(computed.head.fixed.sound_speed_mps, 1466, 1) << "the speed is that of fresh water at 15 deg C";
  request.settings.sound_speed_mps = 1490.658551265436;
  const DecodedPing fixed = answer(device(), request);
  EXPECT_EQ(fixed.head.fixed.fire.sound_speed_mps, 1490.658551265436);
  EXPECT_EQ(fixed.head.fixed.sound_speed_mps, 1490.658551265436);
  request.settings.sound_speed_mps = 3000;
  const DecodedPing wild = answer(device(), request);
  EXPECT_EQ(wild.head.fixed.fire.sound_speed_mps, 3000);
  EXPECT_EQ(wild.head.fixed.sound_speed_mps, 1700);
}

TEST(EncodePing, Version2EchoesItsTail) {
  FireRequest request = fire(2, 1, PingRate::hz10, 0x49, 5, 50);
  request.extension = {4, {1, 2}, 3, {5, 6, 7, 8, 9}};
  const DecodedPing ping = answer(device(), request);
  EXPECT_EQ(wire::bytes_of(ping.head.fixed.extension), wire::bytes_of(request.extension));
}

TEST(EncodePing, VersionMirrorsTheRequest) {
  const auto version = [](int requested, const char* option) {
    const DecodedPing ping =
        answer(device("oculus-m1200d", {{"reply_version", option}}), fire(requested, 1, PingRate::hz10, 0x49, 5, 50));
    EXPECT_THAT(ping.violations, IsEmpty());
    return int{ping.head.fixed.header.version};
  };
  for (const int requested : {0, 1, 2}) EXPECT_EQ(version(requested, "mirror"), requested);
  EXPECT_EQ(version(9, "mirror"), 2);
  EXPECT_EQ(version(0, "2"), 2);
  EXPECT_EQ(version(2, "0"), 0);
  EXPECT_EQ(version(2, "1"), 1);
}

TEST(EncodePing, EnvironmentFollowsTheRequest) {
  const auto state = device();
  const FireRequest request = fire(2, 1, PingRate::hz10, 0x49, 5, 50);
  Ping ping = made_up_ping(state, resolve(request, state).settings);
  ping.request.water.temperature_c = 7.5;
  ping.request.sonar_in_world.position_m.z = -20;
  // A heading of 90 (east) is yaw 0 in ENU, where ahead is world +x. The bow rises by a negative turn about the axis to port.
  ping.request.vehicle_in_world.orientation = quat_from_rpy({rad_from_deg(4), rad_from_deg(-3), 0});
  const auto decoded = decode_ping(encode_ping(ping, state, request));
  ASSERT_TRUE(decoded.has_value());
  const PingResultV2& fixed = decoded->head.fixed;
  EXPECT_EQ(fixed.temperature_c, 7.5);
  EXPECT_NEAR(fixed.pressure_bar, 1.013 + 0.0981 * 20, 0.005);
  EXPECT_NEAR(fixed.heading_deg, 90, 0.3);
  EXPECT_NEAR(fixed.pitch_deg, 3, 1e-9);
  EXPECT_NEAR(fixed.roll_deg, 4, 1e-9);
  EXPECT_EQ(fixed.header.source, 7001);
  EXPECT_EQ(fixed.frequency_hz, 1.2e6);
}

TEST(EncodePing, TheUnitOfTheStartTimeIsAnOption) {
  // Fired 12.25 s after power-up.
  EXPECT_EQ(answer(device(), fire(2, 1, PingRate::hz10, 0x49, 5, 50)).head.fixed.ping_start_time_s, 12.25);
  EXPECT_EQ(answer(device(), fire(0, 1, PingRate::hz10, 0x49, 5, 50)).head.ping_start_counter,
            static_cast<std::uint32_t>(12'250'000'000ull % 0x1'0000'0000ull));
  const auto state = device("oculus-m1200d", {{"ping_start_time_unit", "microseconds"}});
  EXPECT_EQ(answer(state, fire(0, 1, PingRate::hz10, 0x49, 5, 50)).head.ping_start_counter, 12'250'000u);
}

// For every model and mode, bearings are trunc(100 asin(s) in degrees); s goes linearly from -sin to +sin of half the aperture.
TEST(Bearings, FollowTheLawForEveryModel) {
  for (const auto& model : models()) {
    for (std::size_t mode = 0; mode < model->modes.size(); ++mode) {
      const double half_deg = std::round(deg_from_rad(model->modes[mode].horizontal_aperture_rad)) / 2;
      for (const int flags : {0x09, 0x49}) {
        const DecodedPing ping =
            answer(device(model->profile.c_str()), fire(0, static_cast<int>(mode) + 1, PingRate::hz10, flags, 1, 50));
        const auto beams = static_cast<double>(ping.beams());
        const double edge = std::sin(rad_from_deg(half_deg));
        EXPECT_EQ(ping.bearings_cdeg.front(), std::lround(-100 * half_deg))
            << "float azimuths must not truncate the first bearing";
        for (std::size_t beam = 0; beam < ping.beams(); ++beam) {
          const double exact = 100 * deg_from_rad(std::asin(-edge + 2 * edge * static_cast<double>(beam) / (beams - 1)));
          EXPECT_NEAR(ping.bearings_cdeg[beam], std::trunc(exact + std::copysign(1e-3, exact)), 0)
              << model->profile << " " << beam;
          EXPECT_EQ(ping.bearings_cdeg[beam], -ping.bearings_cdeg[ping.beams() - 1 - beam]) << model->profile << " " << beam;
        }
      }
    }
  }
}

TEST(Bearings, PortIsNegative) {
  EXPECT_EQ(bearing_cdeg_from_azimuth(rad_from_deg(30)), -3000);
  EXPECT_EQ(bearing_cdeg_from_azimuth(rad_from_deg(-12.345)), 1234);
  EXPECT_EQ(bearing_cdeg_from_azimuth(static_cast<float>(rad_from_deg(30))), -3000);
  EXPECT_EQ(bearing_cdeg_from_azimuth(0), 0);
}

}  // namespace
}  // namespace sonar::oculus::tests
