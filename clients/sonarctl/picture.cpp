#include "clients/sonarctl/picture.hpp"

#include <algorithm>

#include "core/base/geometry.hpp"

namespace sonar::clients {

namespace {

/// Of samples that rarely come near their maximum: what so many of a thousand do not exceed.
float brightest_of(std::vector<float> samples, std::size_t per_mille) {
  const auto place = samples.begin() + static_cast<std::ptrdiff_t>((samples.size() - 1) * per_mille / 1000);
  std::nth_element(samples.begin(), place, samples.end());
  return std::max(1.0f, *place);
}

Result<PolarImage> picture_of(const oculus::DecodedPing& ping) {
  if (!ping.has_image || ping.rows() == 0 || ping.beams() == 0)
    return failure(ErrorKind::bad_data,
                   "ping " + std::to_string(ping.head.fixed.ping_id) + " does not hold the image it announces");
  PolarImage image;
  image.rows = ping.rows();
  image.beams = ping.beams();
  image.row_spacing_m = ping.head.fixed.range_resolution_m;
  for (std::size_t beam = 0; beam < image.beams; ++beam) image.azimuth_rad.push_back(ping.azimuth_rad(beam));
  image.samples.reserve(image.rows * image.beams);
  for (std::size_t row = 0; row < image.rows; ++row)
    for (std::size_t beam = 0; beam < image.beams; ++beam) image.samples.push_back(static_cast<float>(ping.sample(row, beam)));
  image.full_scale = 254;
  if (ping.bytes_per_sample() > 1) image.full_scale = brightest_of(image.samples, 999);
  return image;
}

Result<PolarImage> picture_of(const bvt::PolarPing& ping) {
  if (!ping.has_signal()) return failure(ErrorKind::bad_data, "ping " + std::to_string(ping.number) + " holds no samples");
  PolarImage image;
  image.rows = static_cast<std::size_t>(ping.bins);
  image.beams = static_cast<std::size_t>(ping.beams);
  image.row_spacing_m = static_cast<double>(ping.bin_m);
  image.start_m = static_cast<double>(ping.start_m);
  for (std::size_t beam = 0; beam < image.beams; ++beam)
    image.azimuth_rad.push_back(-rad_from_deg(ping.bearing_deg(static_cast<double>(beam))));
  image.samples.reserve(image.rows * image.beams);
  for (std::size_t row = 0; row < image.rows; ++row)
    for (std::size_t beam = 0; beam < image.beams; ++beam) image.samples.push_back(ping.samples[beam * image.rows + row]);
  image.full_scale = brightest_of(image.samples, 990);
  return image;
}

PolarImage picture_of(const ArisPing& ping) {
  const aris::DecodedFrame& frame = ping.frame;
  PolarImage image;
  image.rows = frame.samples;
  image.beams = frame.beams;
  image.row_spacing_m = static_cast<double>(frame.header.window_length_m) / static_cast<double>(frame.samples);
  image.start_m = static_cast<double>(frame.header.window_start_m);
  image.azimuth_rad = ping.azimuth_rad;
  image.samples.reserve(image.rows * image.beams);
  for (std::size_t row = 0; row < image.rows; ++row)
    for (std::size_t beam = image.beams; beam > 0; --beam)
      image.samples.push_back(static_cast<float>(std::to_integer<int>(frame.picture[row * image.beams + beam - 1])));
  image.full_scale = 255;
  return image;
}

}  // namespace

Result<PolarImage> picture_of(const AnyPing& ping) {
  if (const auto* drawn = std::get_if<PicturePing>(&ping)) {
    if (drawn->image.beams >= 2) return drawn->image;
    return failure(ErrorKind::usage, "one beam makes no picture: sonarctl listen prints the profiles of an Omniscan");
  }
  if (const auto* of_aris = std::get_if<ArisPing>(&ping)) return picture_of(*of_aris);
  if (const auto* of_oculus = std::get_if<oculus::DecodedPing>(&ping)) return picture_of(*of_oculus);
  return picture_of(std::get<BlueViewPing>(ping).polar);
}

}  // namespace sonar::clients
