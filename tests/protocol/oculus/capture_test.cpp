// Tests with three real pings of an M1200d in mode 2. They are stored outside the repository, in the folder that SONARD_CAPTURES
// names.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>

#include "core/sonar/gain_assist.hpp"
#include "tests/protocol/oculus/oculus_testing.hpp"

namespace sonar::oculus::tests {
namespace {

/// Returns the capture, which lies in the folder itself or in oculus/ below it.
std::optional<Bytes> captured() {
  const char* folder = std::getenv("SONARD_CAPTURES");
  if (folder == nullptr) return std::nullopt;
  for (const char* name : {"three_pings_8bit.raw", "oculus/three_pings_8bit.raw"}) {
    std::ifstream file(std::filesystem::path(folder) / name, std::ios::binary);
    if (!file) continue;
    const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    Bytes bytes;
    for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
    return bytes;
  }
  return std::nullopt;
}

class Capture : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto bytes = captured();
    if (!bytes) GTEST_SKIP() << "SONARD_CAPTURES names no folder with three_pings_8bit.raw";
    Decoder decoder;
    decoder.append(*bytes);
    while (auto received = decoder.next())
      if (auto* ping = std::get_if<DecodedPing>(&*received)) pings_.push_back(std::move(*ping));
    skipped_ = decoder.skipped_bytes();
    ASSERT_EQ(pings_.size(), 3u);
  }
  std::vector<DecodedPing> pings_;
  std::uint64_t skipped_ = 0;
};

TEST_F(Capture, Decodes) {
  EXPECT_EQ(skipped_, 0u);
  PingSequence sequence;
  const std::uint32_t start_times[] = {3103899264u, 3166401394u, 3228903491u};
  for (std::size_t i = 0; i < 3; ++i) {
    const DecodedPing& ping = pings_[i];
    const PingResultV2& fixed = ping.head.fixed;
    EXPECT_THAT(ping.violations, ::testing::IsEmpty());
    EXPECT_THAT(sequence.add(ping), ::testing::IsEmpty());
    EXPECT_EQ(fixed.header.source, 7892);
    EXPECT_EQ(fixed.header.version, 0);
    EXPECT_EQ(fixed.header.payload_size, 182000u);
    EXPECT_EQ(fixed.ping_id, 415323u + i);
    EXPECT_EQ(fixed.fire.mode, 2);
    EXPECT_EQ(static_cast<int>(fixed.fire.ping_rate), 195);
    EXPECT_EQ(fixed.fire.network_speed, 25);
    EXPECT_EQ(fixed.fire.gamma, 127);
    EXPECT_EQ(fixed.fire.flags, 0x19);
    EXPECT_EQ(fixed.fire.range, 2.0);
    EXPECT_EQ(fixed.fire.gain_percent, 50.0);
    EXPECT_EQ(fixed.fire.sound_speed_mps, 1490.658551265436);
    EXPECT_EQ(fixed.sound_speed_mps, 1490.658551265436);
    EXPECT_EQ(fixed.frequency_hz, 140.625e6 / 67);
    EXPECT_EQ(fixed.range_resolution_m, 0.0028421889710794315);
    EXPECT_EQ(ping.head.ping_start_counter, start_times[i]);
    EXPECT_EQ(ping.rows(), 703u);
    EXPECT_EQ(ping.beams(), 256u);
    EXPECT_EQ(fixed.sizes.image_offset, 2048u);
    EXPECT_EQ(fixed.sizes.image_size, 179968u);
    EXPECT_EQ(fixed.sizes.message_size, 182016u);
  }
  EXPECT_EQ(sequence.skipped_ids(), 0u);
}

TEST_F(Capture, ReencodesToTheSameBytesExceptTheFiller) {
  for (const DecodedPing& ping : pings_) {
    Bytes samples;
    for (std::size_t row = 0; row < ping.rows(); ++row)
      samples.insert(samples.end(), ping.row_samples(row).begin(), ping.row_samples(row).end());
    const Bytes again = encode_ping(ping.head, {ping.bearings_cdeg, ping.row_gains, samples});
    ASSERT_EQ(again.size(), ping.message.size());
    const std::size_t filler = ping_v1_size + 2 * ping.beams();
    EXPECT_EQ(filler, 634u);
    EXPECT_TRUE(std::equal(again.begin(), again.begin() + static_cast<std::ptrdiff_t>(filler), ping.message.begin()));
    EXPECT_TRUE(std::equal(again.begin() + image_offset, again.end(), ping.message.begin() + image_offset));
  }
}

TEST_F(Capture, OurBearingsAreTheDevices) {
  FireRequest request = fire(0, 2, PingRate::hz10, 0x19, 2, 50);
  EXPECT_EQ(answer(device(), request).bearings_cdeg, pings_[0].bearings_cdeg);
}

// The emulated device gets the captured request; every computed field is equal to the captured one.
TEST_F(Capture, OurDeviceAnswersTheSameRequestAlike) {
  FireRequest request = fire(0, 2, PingRate{195}, 0x19, 2, 50);
  request.settings.network_speed = 25;
  request.settings.sound_speed_mps = 1490.658551265436;
  auto state = device();
  state.id = 7892;
  const DecodedPing ours = answer(state, request, 415323);
  const PingResultV2 &mine = ours.head.fixed, &real = pings_[0].head.fixed;
  EXPECT_EQ(wire::bytes_of(mine.header), wire::bytes_of(real.header));
  EXPECT_EQ(wire::bytes_of(mine.fire), wire::bytes_of(real.fire));
  EXPECT_EQ(wire::bytes_of(mine.sizes), wire::bytes_of(real.sizes));
  EXPECT_EQ(mine.row_count, real.row_count);
  EXPECT_EQ(mine.range_resolution_m, real.range_resolution_m);
  EXPECT_NEAR(mine.frequency_hz, real.frequency_hz, 0.2);
}

// docs/protocols/oculus.md, 5.2: the third ping is near the level that the first two were fitted to.
TEST_F(Capture, IsAsBrightAsGainAssistWouldMakeIt) {
  for (const DecodedPing& received : pings_) {
    Ping ping;
    ping.request.settings.format = {.bits = 8, .max_code = 254};
    for (std::size_t row = 0; row < received.rows(); ++row)
      ping.samples.insert(ping.samples.end(), received.row_samples(row).begin(), received.row_samples(row).end());
    EXPECT_NEAR(percentile_of_full_scale(ping), assisted_level, 0.015);
  }
}

TEST_F(Capture, SamplesSaturateAt254) {
  std::uint32_t highest = 0;
  for (const DecodedPing& ping : pings_)
    for (std::size_t row = 0; row < ping.rows(); ++row)
      for (std::size_t beam = 0; beam < ping.beams(); ++beam) highest = std::max(highest, ping.sample(row, beam));
  EXPECT_EQ(highest, 254u);
}

}  // namespace
}  // namespace sonar::oculus::tests
