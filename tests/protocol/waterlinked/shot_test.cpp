// Tests the datagrams of a shot by reading them.
#include <cmath>

#include "protocol/waterlinked/messages.hpp"
#include "tests/protocol/waterlinked/waterlinked_testing.hpp"

namespace sonar::waterlinked::tests {
namespace {

/// Returns a ping in which pixel i has range i and strength 30 + i.
Ping ping_of(const Unit& unit) {
  Ping ping;
  ping.request.model = unit.device.model;
  ping.request.settings = unit.settings;
  ping.request.vendor_settings = unit.device.settings;
  ping.request.number = PingNumber{41};
  ping.request.fired_at = at_s(3.25);
  for (std::uint32_t i = 0; i < columns * rows; ++i) {
    const std::uint32_t code = RangePixel{30 + i, i}.code();
    for (std::uint32_t b = 0; b < 4; ++b) ping.samples.push_back(static_cast<std::byte>(code >> (8 * b) & 0xFF));
  }
  return ping;
}
std::vector<Bytes> shot(const Unit& unit) {
  protocol::Port port{.kind = protocol::Port::Kind::udp_stream};
  return vendor().datagrams(port, ping_of(unit), unit.device);
}
Decoded read(const Bytes& datagram) {
  const auto content = rip_content(datagram);
  EXPECT_TRUE(content);
  return content ? decode(*content) : Decoded{};
}

TEST(WaterLinkedShot, TheTwoImagesHaveTheSameTimeAndMask) {
  Unit unit;
  unit.post("/acoustics/speed_of_sound", "1491");
  const std::vector<Bytes> datagrams = shot(unit);
  ASSERT_EQ(datagrams.size(), 2u);
  const auto ranges = read(datagrams[0]).ranges;
  const auto strengths = read(datagrams[1]).strengths;
  ASSERT_TRUE(ranges && strengths);
  for (const Shot& s : {ranges->shot, strengths->shot}) {
    EXPECT_EQ(s.at, at_s(3.25));
    EXPECT_EQ(s.sequence, 41u);
    EXPECT_EQ(s.speed_of_sound_mps, 1491);
    EXPECT_EQ(s.range_m, 15);
    EXPECT_EQ(s.frequency, 5u);
    EXPECT_EQ(s.width, 256u);
    EXPECT_EQ(s.height, 64u);
    EXPECT_EQ(s.horizontal_deg, 90);
    EXPECT_EQ(s.vertical_deg, 40);
  }
  EXPECT_EQ(ranges->pixel_scale_m, 0.000762939453125f);
  ASSERT_EQ(ranges->pixels.size(), 16384u);
  ASSERT_EQ(strengths->pixels.size(), 16384u);
  for (std::size_t i = 0; i < 16384; ++i) {
    EXPECT_EQ(ranges->pixels[i], i);
    EXPECT_EQ(strengths->pixels[i] != 0, ranges->pixels[i] != 0);
  }
}

TEST(WaterLinkedShot, StrengthIsLogarithmic) {
  EXPECT_EQ(strength_pixel(0), 0);
  EXPECT_EQ(strength_pixel(30), 0);
  EXPECT_EQ(strength_pixel(31), 1);
  EXPECT_EQ(strength_pixel(10644), 255);
  EXPECT_EQ(strength_pixel(0x7FFF), 255);
  EXPECT_EQ(strength_pixel(600) - strength_pixel(300), 30);
}

TEST(WaterLinkedShot, VersionOneIsNotCompressed) {
  const std::vector<Bytes> plain = shot(Unit(protocol::OptionValues{{"rip", "1"}})), packed = shot(Unit());
  EXPECT_EQ(rip_content(plain[0]), rip_content(packed[0]));
  EXPECT_EQ(plain[0].size(), rip_content(plain[0])->size() + rip_overhead);
  EXPECT_LT(packed[1].size(), plain[1].size());
}

TEST(WaterLinkedShot, DamagedPacketsAreRefused) {
  const Bytes good = shot(Unit())[0];
  for (const std::size_t at : {std::size_t{0}, std::size_t{4}, std::size_t{100}, good.size() - 1}) {
    Bytes bad = good;
    bad[at] ^= std::byte{1};
    EXPECT_FALSE(rip_content(bad)) << at;
  }
  EXPECT_FALSE(rip_content(BytesView(good).first(good.size() - 1)));
  EXPECT_FALSE(rip_content(BytesView(good).first(11)));
  const Bytes junk(20, std::byte{0xFF});
  Bytes no_snappy = rip_packet(junk, Rip::one);
  no_snappy[3] = std::byte{'2'};
  EXPECT_FALSE(rip_content(no_snappy)) << "the packet has the CRC of RIP1";
  EXPECT_FALSE(decode(junk).ranges);
}

TEST(WaterLinkedShot, ImuSamplesAreTenMillisecondsApart) {
  Unit unit;
  unit.post("/output/imu-batch/enabled", "true");
  const std::vector<Bytes> low = shot(unit);
  ASSERT_EQ(low.size(), 3u);
  const auto batch = read(low[2]).imu;
  ASSERT_TRUE(batch);
  ASSERT_EQ(batch->samples.size(), 20u);
  EXPECT_LE(batch->samples.back().at, at_s(3.25));
  EXPECT_LT(at_s(3.25) - batch->samples.back().at, std::chrono::milliseconds(10));
  EXPECT_EQ(batch->samples[1].at - batch->samples[0].at, std::chrono::milliseconds(10));
  for (const auto& sample : batch->samples) {
    EXPECT_THAT(sample.specific_force_mps2, ::testing::ElementsAre(0.0f, 0.0f, -9.81f)) << "a level sonar, z down";
    EXPECT_THAT(sample.rate_radps, ::testing::Each(0.0f));
  }
  unit.post("/acoustics/mode", "\"high-frequency\"");
  EXPECT_EQ(read(shot(unit)[2]).imu->samples.size(), 5u);
}

TEST(WaterLinkedShot, ImuSamplesContinueFromThePreviousShot) {
  Unit unit;
  unit.post("/output/imu-batch/enabled", "true");
  unit.device.framed_at = at_s(3.25) - std::chrono::milliseconds(333);
  EXPECT_EQ(read(shot(unit)[2]).imu->samples.size(), 33u);
  unit.device.framed_at = at_s(3.25) - std::chrono::minutes(1);
  EXPECT_EQ(read(shot(unit)[2]).imu->samples.size(), 20u) << "after a pause, a batch has the samples of one period";
}

}  // namespace
}  // namespace sonar::waterlinked::tests
