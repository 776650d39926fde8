// The pictures of pings that viewers get. For each make, they are those that the host of the make draws.
#include "daemon/emulator/view/ping_payloads.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace sonar::driver_picture_test {
namespace {

class DriverPictures : public testing::TestWithParam<protocol::Make> {};
INSTANTIATE_TEST_SUITE_P(OfEveryMake, DriverPictures, testing::ValuesIn(protocol::makes().begin(), protocol::makes().end()),
                         [](const auto& of) { return std::string(of.param.name()); });

std::shared_ptr<Ping> ping_of(const protocol::Vendor& vendor, const protocol::DeviceState& state, std::uint32_t number) {
  auto ping = std::make_shared<Ping>();
  const protocol::ChangeSettings first = vendor.initial_settings(state);
  ping->request.model = state.model;
  ping->request.number = PingNumber(number);
  ping->request.fired_at = Time{} + number * std::chrono::milliseconds(100);
  ping->request.settings = first.settings;
  ping->request.vendor_settings = first.vendor_settings;
  if (const auto step = vendor.scan_step(number, state)) {
    ping->request.settings = step->settings;
    ping->request.vendor_settings = step->aim.with;
  }
  const PingSettings& s = ping->request.settings;
  const auto beams = static_cast<std::size_t>(s.beam_count), rows = static_cast<std::size_t>(s.range_bin_count);
  for (std::size_t i = 0; i < beams; ++i)
    ping->beam_azimuth_rad.push_back(beams < 2 ? 0.0f : 0.5f - static_cast<float>(i) / static_cast<float>(beams - 1));
  for (std::size_t i = 0; i < beams * rows * static_cast<std::size_t>(s.format.bits / 8); ++i)
    ping->samples.push_back(static_cast<std::byte>(i * 7 % 251));
  return ping;
}

protocol::DeviceState state_of(const protocol::Make& make) {
  protocol::DeviceState state;
  state.name = "front";
  state.model = make.device->models().front();
  state.options = *protocol::check_options(*make.device, {});
  state.water = {12, 30, 8.0, 0};
  return state;
}

TEST_P(DriverPictures, PicturesOfOnePingAreMadeOnlyWhenDrawn) {
  const protocol::Make& make = GetParam();
  if (make.picture == PictureKind::sweep || make.picture == PictureKind::waterfall)
    GTEST_SKIP() << "a picture of this make has several pings";
  const protocol::DeviceState state = state_of(make);
  const std::shared_ptr<Ping> ping = ping_of(*make.device, state, 1);
  DriverPicture::Drawing drawing = DriverPicture(make).after(ping, state);
  ASSERT_TRUE(drawing);
  EXPECT_THAT(drawing().image.samples, testing::Contains(testing::Gt(0)));
  std::fill(ping->samples.begin(), ping->samples.end(), std::byte{0});
  EXPECT_THAT(drawing().image.samples, testing::Each(testing::Le(1))) << "a sample of 0 may be drawn as 1";
}

TEST_P(DriverPictures, AreOfItsKindAndCanBeDrawn) {
  const protocol::Make& make = GetParam();
  const protocol::DeviceState state = state_of(make);
  DriverPicture pictures(make);
  DriverPicture::Drawing last;
  for (std::uint32_t number = 1; number <= 250; number += make.picture == PictureKind::fan ? 100 : 1)
    if (auto drawing = pictures.after(ping_of(*make.device, state, number), state)) last = drawing;
  ASSERT_TRUE(last);
  const SonarPicture picture = last();
  EXPECT_EQ(picture.kind, make.picture);
  EXPECT_EQ(picture.column != SonarPicture::Column::none, make.picture == PictureKind::points);
  if (make.name() == "norbit") {
    EXPECT_EQ(picture.column, SonarPicture::Column::sent);
  }
  if (make.picture == PictureKind::fan || make.name() == "norbit") {
    EXPECT_EQ(picture.image.shades.gamma, make.shades.gamma);
  }
  PicturePainter painter(view_fan_style());
  EXPECT_NE(fan_payload("front", Time{}, picture, painter), nullptr);
  if (make.picture == PictureKind::sweep) {
    EXPECT_EQ(picture.image.beams, 201u) << "the picture has the half circle ahead";
    EXPECT_NEAR(picture.range_m(), 10, 0.3);
    EXPECT_NEAR(picture.head_rad, -51 * 2 * pi / 400, 1e-9) << "the head has turned back from starboard";
    for (std::size_t beam = 0; beam < picture.image.beams; ++beam) EXPECT_GT(picture.image.at(10, beam), 0) << beam;
  }
  if (make.picture == PictureKind::waterfall) {
    EXPECT_EQ(picture.image.rows, 250u);
    ASSERT_EQ(picture.row_age_s.size(), 250u);
    for (std::size_t row = 0; row < 250; ++row) EXPECT_NEAR(picture.row_age_s[row], 0.1 * static_cast<double>(row), 1e-9);
  }
}

TEST(FanPayload, SamplesWithoutSignalAreInsideTheFan) {
  SonarPicture silent;
  silent.image.rows = 100;
  silent.image.beams = 101;
  silent.image.row_spacing_m = 0.1;
  for (int beam = 0; beam < 101; ++beam) silent.image.azimuth_rad.push_back(0.5 - 0.01 * beam);
  silent.image.samples.resize(100 * 101);
  PicturePainter painter(view_fan_style());
  const auto payload = fan_payload("front", Time{}, silent, painter);
  ASSERT_NE(payload, nullptr);
  const wire::Bytes& pixels = *payload->pieces.back().bytes;
  const auto inside = std::ranges::count(pixels, std::byte{1}), outside = std::ranges::count(pixels, std::byte{0});
  EXPECT_EQ(static_cast<std::size_t>(inside + outside), pixels.size());
  EXPECT_NEAR(static_cast<double>(inside) / static_cast<double>(pixels.size()), 0.52, 0.03)
      << "the share of a sector of 1 rad in its bounding box";
}

}  // namespace
}  // namespace sonar::driver_picture_test
