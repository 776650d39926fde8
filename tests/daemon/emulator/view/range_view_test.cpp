// The two views of a range image: a picture from above, and points in space.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/sonar/range_image.hpp"
#include "daemon/emulator/view/ping_payloads.hpp"
#include "protocol/vendor.hpp"

namespace sonar {
namespace {

void set_pixel(Ping& ping, std::size_t column, std::size_t row, std::uint32_t strength, double range_m = 6) {
  const RangePixel pixel{strength, static_cast<std::uint32_t>(range_m / (50.0 / 65536))};
  for (std::size_t b = 0; b < 4; ++b)
    ping.samples[4 * (256 * row + column) + b] = static_cast<std::byte>(pixel.code() >> (8 * b) & 0xFF);
}

/// Returns a range image in which one pixel has a return, at 6 m and full strength.
Ping ping_with(std::size_t column, std::size_t row) {
  const protocol::Profile profile = *protocol::find_profile("waterlinked-3d15");
  protocol::DeviceState device;
  device.model = profile.model;
  device.options = *protocol::check_options(*profile.vendor, {});
  const protocol::ChangeSettings initial = profile.vendor->initial_settings(device);
  Ping ping;
  ping.request.model = profile.model;
  ping.request.settings = initial.settings;
  ping.request.vendor_settings = initial.vendor_settings;
  const RangeImageGrid grid(ping.request);
  for (int c = 0; c < grid.columns; ++c) ping.beam_azimuth_rad.push_back(static_cast<float>(grid.azimuth_rad(c)));
  ping.samples.resize(4 * 256 * 64);
  set_pixel(ping, column, row, 400);
  return ping;
}

TEST(RangeView, InThePictureFromAboveAPixelHasItsBearingAndHorizontalRange) {
  const Ping ping = ping_with(64, 0);  // 20 degrees down
  const PolarImage image = polar_image_of(ping);
  std::size_t bright = 0, at = 0;
  for (std::size_t i = 0; i < image.samples.size(); ++i)
    if (image.samples[i] > 0) ++bright, at = i;
  EXPECT_EQ(bright, 1u);
  EXPECT_EQ(at % image.beams, 64u);
  EXPECT_NEAR((static_cast<double>(at / image.beams) + 0.5) * image.row_spacing_m, 6 * std::cos(20 * pi / 180), 0.04);
  EXPECT_EQ(image.samples[at], image.full_scale);
}

TEST(RangeView, HasOnePointForEachReturn) {
  const auto size = [](const Ping& ping) { return cloud_payload("front", ping, 0)->pieces.front().bytes->size(); };
  Ping none = ping_with(0, 0);
  std::fill(none.samples.begin(), none.samples.end(), std::byte{0});
  EXPECT_GT(size(ping_with(200, 60)), size(none));
}

/// The threshold is relative to the strongest pixel, because the echoes of a DVL are far below the full scale of its samples.
TEST(RangeView, ThePointsAreThoseThatAreNotMuchWeakerThanTheStrongest) {
  Ping ping = ping_with(200, 60);
  const auto size = [&](double threshold) { return cloud_payload("front", ping, threshold)->pieces.front().bytes->size(); };
  const std::size_t one = size(0);
  set_pixel(ping, 200, 60, 0);
  for (std::size_t column = 0; column < 3; ++column) set_pixel(ping, column, 60, 10);
  set_pixel(ping, 3, 60, 1);
  set_pixel(ping, 4, 60, 400, 0);  // range 0 means no return, whatever the strength is
  const std::size_t all = size(0), strong = size(0.35);
  EXPECT_GT(all, strong);
  EXPECT_EQ(strong - one, 2 * (all - strong)) << "the threshold passes three of four points";
}

}  // namespace
}  // namespace sonar
