#include "protocol/blueview/encode_ping.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include "tests/protocol/blueview/blueview_testing.hpp"

namespace sonar::blueview {
namespace {

/// Makes a ping whose samples are 100 row + beam.
Ping numbered_ping(const protocol::DeviceState& device, const SonarSettings& all) {
  Ping ping;
  ping.request.model = device.model;
  ping.request.settings = ping_settings(all, device);
  ping.request.number = PingNumber(42);
  ping.request.fired_at = test::at_s(0.5);
  ping.request.vehicle_in_world = {{0, 0, -7}, quat_from_rpy({rad_from_deg(3), rad_from_deg(-10), rad_from_deg(90)})};
  const PingSettings& s = ping.request.settings;
  for (int row = 0; row < s.range_bin_count; ++row)
    for (int beam = 0; beam < s.beam_count; ++beam) {
      const auto v = static_cast<std::uint16_t>(100 * row + beam);
      ping.samples.push_back(static_cast<std::byte>(v & 0xFF));
      ping.samples.push_back(static_cast<std::byte>(v >> 8));
    }
  return ping;
}

struct Decoded {
  std::int32_t head = 0, tz = 0, c = 0;
  std::uint32_t number = 0, raw_length = 0;
  double t = 0, nav_time_s = 0;
  float start = 0, stop = 0, fov_min = 0, fov_max = 0, bin = 0, depth = 0, pitch = 0, roll = 0, heading = 0;
  std::uint16_t beams = 0, bins = 0, nav = 0;
  std::uint8_t format = 0, compression = 0;
  wire::Bytes body;
};
Decoded decode(const wire::Bytes& bytes) {
  Decoded d;
  wire::Reader r(bytes);
  r("head", d.head), r("number", d.number), r("t", d.t), r("tz", d.tz), r("start", d.start), r("stop", d.stop), r("c", d.c);
  r("fov_min", d.fov_min), r("fov_max", d.fov_max), r("bin", d.bin), r("beams", d.beams), r("bins", d.bins);
  r("fmt", d.format), r("compression", d.compression), r("nav", d.nav);
  r("time", d.nav_time_s), r("depth", d.depth), r("pitch", d.pitch), r("roll", d.roll), r("heading", d.heading);
  r("raw_len", d.raw_length);
  EXPECT_TRUE(r.ok());
  const auto rest = r.block("samples", r.remaining());
  d.body.assign(rest.begin(), rest.end());
  return d;
}
int sample(const wire::Bytes& body, int index) {
  return std::to_integer<int>(body[static_cast<std::size_t>(2 * index)]) |
         std::to_integer<int>(body[static_cast<std::size_t>(2 * index + 1)]) << 8;
}

TEST(BlueViewPing, BeamsFollowEachOtherAndBeginAtTheStartRange) {
  const auto device = test::device();
  SonarSettings all = initial_sonar_settings(device);
  all.heads[0].start_m = 2;
  all.heads[0].stop_m = 4;
  const Decoded d = decode(encode_ping(numbered_ping(device, all), device, all));
  EXPECT_EQ(d.number, 42u);
  EXPECT_NEAR(d.t, 1.7e9 + 0.5, 1e-6);
  EXPECT_EQ(d.beams, 512);
  EXPECT_EQ(d.bins, 79);
  EXPECT_FLOAT_EQ(d.start, 2);
  EXPECT_NEAR(d.stop, 4, 0.03);
  EXPECT_NEAR(d.fov_min, -45, 1e-3);
  EXPECT_NEAR(d.fov_max, 45, 1e-3);
  EXPECT_EQ(d.raw_length, 2u * 512 * 79);
  ASSERT_EQ(d.body.size(), d.raw_length);
  const int skipped = grid_of(all.heads[0], 0.0254).skipped;
  for (const auto& [beam, bin] : {std::pair{0, 0}, {0, 78}, {511, 0}, {300, 40}})
    EXPECT_EQ(sample(d.body, beam * 79 + bin), (100 * (skipped + bin) + beam) & 0xFFFF) << beam << " " << bin;
}

TEST(BlueViewPing, CarriesTheVehiclesNavigation) {
  const auto device = test::device();
  const SonarSettings all = initial_sonar_settings(device);
  const Decoded d = decode(encode_ping(numbered_ping(device, all), device, all));
  EXPECT_EQ(d.nav, nav_time | nav_depth | nav_pitch | nav_roll | nav_heading);
  EXPECT_NEAR(d.depth, 7, 1e-5);
  EXPECT_NEAR(d.pitch, 10, 1e-4) << "the bow is up";
  EXPECT_NEAR(d.roll, 3, 1e-4) << "port is up";
  EXPECT_NEAR(d.heading, 0, 1e-4) << "yaw 90 deg from east is north";
}

TEST(BlueViewPing, DeflateGivesTheSameSamples) {
  const auto plain = test::device(), packed = test::device("blueview-p900-90", {{"compression", "deflate"}});
  const SonarSettings all = initial_sonar_settings(plain);
  const Decoded a = decode(encode_ping(numbered_ping(plain, all), plain, all));
  const Decoded b = decode(encode_ping(numbered_ping(packed, all), packed, all));
  EXPECT_EQ(a.compression, 0);
  EXPECT_EQ(b.compression, 1);
  EXPECT_LT(b.body.size(), a.body.size());
  std::vector<Bytef> in(b.body.size()), out(b.raw_length);
  for (std::size_t i = 0; i < in.size(); ++i) in[i] = std::to_integer<Bytef>(b.body[i]);
  uLongf size = out.size();
  ASSERT_EQ(uncompress(out.data(), &size, in.data(), in.size()), Z_OK);
  ASSERT_EQ(size, a.body.size());
  for (std::size_t i = 0; i < out.size(); ++i) ASSERT_EQ(out[i], std::to_integer<Bytef>(a.body[i]));
}

}  // namespace
}  // namespace sonar::blueview
