// Faults of the samples on range images: strengths and ranges are altered separately, and no pixel without a return gets one.
#include "daemon/emulator/faults/alter_message.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/sonar/range_image.hpp"

namespace sonar {
namespace {

struct Images final : RangeImageSettings {
  bool equals(const VendorSettings&) const override { return true; }
};

/// Returns a range image of 2 x 2 pixels: strength 100 at 5 m, no return, 200 at 10 m, 50 at 1 m. The unit of range is a
/// millimetre.
Ping range_image() {
  const auto settings = std::make_shared<Images>();
  settings->range_unit_m = 0.001;
  Ping ping;
  ping.request.vendor_settings = settings;
  ping.request.settings.format.bits = 32;
  ping.request.settings.format.max_code = range_image_max_code(10000);
  ping.request.settings.range_m = 15;
  ping.beam_azimuth_rad = {0.1f, -0.1f};
  for (const RangePixel pixel : {RangePixel{100, 5000}, RangePixel{}, RangePixel{200, 10000}, RangePixel{50, 1000}})
    for (int shift = 0; shift < 32; shift += 8) ping.samples.push_back(static_cast<std::byte>(pixel.code() >> shift));
  return ping;
}

Ping altered(const std::string& kind, const std::map<std::string, std::string>& with) {
  FaultRecord record;
  record.what = kind;
  record.with = with;
  const auto faults = check_fault(record, true);
  EXPECT_TRUE(faults) << faults.error().text;
  Ping ping = range_image();
  alter_ping(faults->front(), {}, nullptr, 0, ping);
  return ping;
}

std::pair<std::uint32_t, std::uint32_t> at(const Ping& ping, std::size_t index) {
  const RangePixel pixel = range_pixel(ping, index);
  return {pixel.strength, pixel.range};
}
using Pixel = std::pair<std::uint32_t, std::uint32_t>;

/// Returns two beams by two rows of a byte, with signals of the same numbers.
Ping with_signals() {
  Ping ping;
  ping.request.settings.format.bits = 8;
  ping.request.settings.format.max_code = 255;
  ping.beam_azimuth_rad = {0.1f, -0.1f};
  for (const int n : {1, 2, 3, 4}) {
    ping.samples.push_back(static_cast<std::byte>(n));
    ping.beam_signal_upa.emplace_back(static_cast<float>(n), 0.0f);
  }
  return ping;
}

std::vector<float> signals_after(const std::string& kind, const std::map<std::string, std::string>& with,
                                 const Ping* kept = nullptr) {
  FaultRecord record;
  record.what = kind;
  record.with = with;
  const auto faults = check_fault(record, true);
  EXPECT_TRUE(faults) << faults.error().text;
  Ping ping = with_signals();
  alter_ping(faults->front(), {}, kept, 0, ping);
  std::vector<float> found;
  for (std::size_t i = 0; i < ping.samples.size(); ++i) {
    found.push_back(ping.beam_signal_upa[i].real());
    EXPECT_EQ(std::to_integer<int>(ping.samples[i]), static_cast<int>(found.back())) << kind << ": sample and signal " << i;
  }
  return found;
}

TEST(SignalFaults, SignalsOfBeamsMoveWithTheSamples) {
  using testing::ElementsAre;
  EXPECT_THAT(signals_after("mirrored", {}), ElementsAre(2, 1, 4, 3));
  EXPECT_THAT(signals_after("plausible-wrong", {{"factor", "2"}}), ElementsAre(1, 2, 1, 2));
  EXPECT_THAT(signals_after("plausible-wrong", {{"factor", "0.5"}}), ElementsAre(3, 4, 0, 0));
  Ping kept = with_signals();
  for (std::byte& sample : kept.samples) sample = std::byte{7};
  for (auto& signal : kept.beam_signal_upa) signal = {7, 0};
  EXPECT_THAT(signals_after("stuck", {}, &kept), ElementsAre(7, 7, 7, 7));
}

TEST(RangeImageFaults, StrengthsChangeAndRangesStay) {
  const Ping louder = altered("gain-step", {{"factor", "2"}, {"fraction", "0"}});
  EXPECT_EQ(at(louder, 0), Pixel(200, 5000));
  EXPECT_EQ(at(louder, 1), Pixel(0, 0)) << "a pixel without a return stays without";
  EXPECT_EQ(at(louder, 2), Pixel(400, 10000));
  const Ping softer = altered("gain-step", {{"factor", "0.5"}, {"fraction", "0"}});
  EXPECT_EQ(at(softer, 3), Pixel(25, 1000));
  const Ping full = altered("saturated", {{"share", "1"}});
  EXPECT_EQ(at(full, 0), Pixel(10000, 5000));
  EXPECT_EQ(at(full, 1), Pixel(0, 0));
  const Ping noise = altered("noise", {});
  EXPECT_EQ(at(noise, 2).second, at(noise, 2).first == 0 ? 0u : 10000u);
  EXPECT_LE(at(noise, 2).first, 10000u);
}

TEST(RangeImageFaults, RangesAreScaledAndCut) {
  const Ping near = altered("missing-ranges", {{"fraction", "0.5"}});
  EXPECT_EQ(at(near, 0), Pixel(100, 5000));
  EXPECT_EQ(at(near, 2), Pixel(0, 0)) << "10 m is beyond half of 15 m";
  const Ping wrong = altered("plausible-wrong", {{"factor", "1.2"}});
  EXPECT_EQ(at(wrong, 0), Pixel(100, 6000));
  EXPECT_EQ(at(wrong, 2), Pixel(200, 12000));
}

}  // namespace
}  // namespace sonar
