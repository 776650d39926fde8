// A program for 4.x with C++ classes. It changes settings one by one, then repeats ping, XY image, colours and range profile,
// as a ROS node does.
// usage: cpp4_settings_xy_profile ADDRESS COLORMAPS
#include <chrono>
#include <vector>

#include "tests/clients/bvtsdk/programs/expect.h"

static void check_settings(const BVTSDK::Head& head) {
  EXPECT_NEAR(head.GetStartRange(), 1, 1e-3);
  EXPECT_NEAR(head.GetStopRange(), 9, 0.05);
  EXPECT(head.GetFluidType() == BVTSDK::FluidType::Freshwater);
  EXPECT(head.GetSoundSpeed() == 1490);
  EXPECT_NEAR(head.GetGainAdjustment(), -6, 1e-6);
  EXPECT_NEAR(head.GetTVGSlope(), 0.25, 1e-6);
  EXPECT(head.GetDynamicPowerManagement());
  EXPECT(head.GetPingInterval() == 50);
  EXPECT(head.GetPingCount() == 1);
  EXPECT(head.GetCenterFreq() == 900000);
}

static void check_colours(const BVTSDK::ColorImage& colours, const BVTSDK::MagImage& image) {
  EXPECT(colours.GetHeight() == image.GetHeight() && colours.GetWidth() == image.GetWidth());
  std::vector<unsigned int> copy(static_cast<std::size_t>(colours.GetHeight()) * static_cast<std::size_t>(colours.GetWidth()));
  colours.CopyBits(copy.data(), static_cast<unsigned int>(copy.size()));
  for (const unsigned int pixel : copy) EXPECT(pixel >> 24 == 255);
  try {
    colours.CopyBits(copy.data(), static_cast<unsigned int>(copy.size()) - 1);
    EXPECT(!"a buffer that is too small");
  } catch (const BVTSDK::SdkException& e) {
    EXPECT(e.ReturnCode() == BVT_BUFFER_TOO_SMALL);
  }
}

static void check_profile(const BVTSDK::RangeProfile& profile) {
  EXPECT(profile.Handle() != nullptr);
  const int count = profile.GetCount();
  EXPECT(count == 512);
  std::vector<float> bearings(static_cast<std::size_t>(count)), ranges(bearings.size());
  std::vector<unsigned short> intensities(bearings.size());
  profile.CopyBearingValues(bearings.data(), count);
  profile.CopyRangeValues(ranges.data(), count);
  profile.CopyIntensityValues(intensities.data(), count);
  Found found[3] = {};
  int valid = 0;
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    EXPECT(i == 0 || bearings[i] > bearings[i - 1]);  // left to right
    EXPECT(ranges[i] > 999 || intensities[i] > 10000);
    valid += ranges[i] <= 999;
    if (ranges[i] <= 999) look(found, intensities[i], ranges[i], bearings[i]);
  }
  EXPECT(valid == profile.GetValidCount() && valid < count);
  expect_targets("range profile", found);
}

int main(int, char** arguments) {
  try {
    BVTSDK::Head head = NULL;  // members of the node, which exist before the sonar
    BVTSDK::Ping ping = NULL;
    BVTSDK::MagImage image = NULL;
    EXPECT(head.Handle() == nullptr);
    BVTSDK::Sonar sonar;
    sonar.Open("NET", arguments[1]);
    EXPECT(sonar.IsConnected() && !sonar.IsFile() && !sonar.SupportsMulticast());
    EXPECT(sonar.GetSonarModelName() == "BlueView P900-90");
    EXPECT(sonar.GetFileSize() == 0 && sonar.GetNavDataCount() == 0);
    head = sonar.GetHead(0);
    head.SetStartRange(1);
    head.SetStopRange(9);
    head.SetFluidType(BVTSDK::FluidType::Freshwater);
    head.SetSoundSpeed(1490);
    head.SetRangeResolution(0);
    head.SetGainAdjustment(-6);
    head.SetTVGSlope(0.25f);
    head.SetDynamicPowerManagement(true);
    head.SetPingInterval(50);
    check_settings(head);
    head.SetTVGSlope(0);

    BVTSDK::ImageGenerator generator;
    generator.SetRangeProfileIntensityThreshold(10000);
    generator.SetNoiseThreshold(0.01f);
    generator.SetHead(head);
    BVTSDK::ColorMapper mapper;
    mapper.Load(std::string(arguments[2]) + "/jet.cmap");

    const auto start = std::chrono::steady_clock::now();
    const int pings = 12;
    for (int i = 0; i < pings; ++i) {
      ping = head.GetPing(-1);
      image = generator.GetImageXY(ping);
      const BVTSDK::ColorImage colours = mapper.MapImage(image);
      const BVTSDK::RangeProfile profile = generator.GetRangeProfile(ping);
      if (i == 0) {
        expect_targets_in_image("XY", image.Handle());
        check_colours(colours, image);
        check_profile(profile);
      }
    }
    const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    printf("%d pings in %.1f s: %.1f a second\n", pings, took, pings / took);
    return 0;
  } catch (const BVTSDK::SdkException& e) {
    fprintf(stderr, "%d %s: %s\n", e.ReturnCode(), e.ErrorName().c_str(), e.ErrorMessage().c_str());
    return 1;
  }
}
