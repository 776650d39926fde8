// Tests with a recording of a real ARIS 1200 with a telephoto lens, stored outside the repository: our description of the header
// must read it, its settings must be valid, and our formula must give its window.
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/protocol/aris/aris_testing.hpp"

namespace sonar::aris {
namespace {

Bytes captured() {
  const char* const folder = std::getenv("SONARD_CAPTURES");
  if (folder == nullptr) return {};
  std::ifstream file(std::filesystem::path(folder) / "aris/sample.aris", std::ios::binary);
  Bytes bytes;
  for (std::istreambuf_iterator<char> at(file), end; at != end; ++at) bytes.push_back(static_cast<std::byte>(*at));
  return bytes;
}

TEST(ArisCapture, HeaderIsReadAsDescribed) {
  const Bytes bytes = captured();
  if (bytes.empty()) GTEST_SKIP() << "SONARD_CAPTURES names no folder with aris/sample.aris";
  ASSERT_EQ(bytes.size(), padded_header_size + 6 * (padded_header_size + 2000 * 48));
  for (std::size_t frame = 0; frame < 6; ++frame) {
    FrameHeader h;
    wire::Reader reader(BytesView(bytes).subspan(padded_header_size + frame * (padded_header_size + 2000 * 48)));
    fields(reader, h);
    EXPECT_EQ(h.frame_index, frame);
    EXPECT_EQ(h.version, file_version);
    EXPECT_EQ(h.system, static_cast<std::uint32_t>(SystemType::aris_1200));
    EXPECT_EQ(h.ping_mode, 1u);
    EXPECT_EQ(h.samples_per_beam, 2000u);
    EXPECT_EQ(h.start_delay_us, 4593u);
    EXPECT_EQ(h.large_lens, 1u);
    EXPECT_EQ(h.receiver_gain_db, 24u);
    EXPECT_NEAR(h.sound_speed_mps, 1435.93, 0.01);
    EXPECT_NEAR(h.frame_rate_hz, 6.548, 0.001);
    EXPECT_NEAR(h.acceleration_g[2], -1.03, 0.1);
    const Acoustics a{1,
                      h.frame_rate_hz,
                      h.samples_per_beam,
                      h.start_delay_us,
                      h.cycle_us,
                      h.sample_period_us,
                      h.pulse_us,
                      h.ping_mode,
                      true,
                      Frequency::high,
                      true,
                      24};
    const auto state = tests::device("aris-1200");
    EXPECT_EQ(judge(a, product_of(*state.model), false).refusal, "") << "the device's own settings are valid";
    EXPECT_NEAR(h.window_length_m, a.samples_per_beam * a.sample_period_us * 1e-6 * 1435.93 / 2, 0.25);
  }
}

}  // namespace
}  // namespace sonar::aris
