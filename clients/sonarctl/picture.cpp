#include "clients/sonarctl/picture.hpp"

#include <algorithm>

namespace sonar::clients {

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
  if (ping.bytes_per_sample() > 1) {
    std::vector<float> sorted = image.samples;
    const auto place = sorted.begin() + static_cast<std::ptrdiff_t>((sorted.size() - 1) * 999 / 1000);
    std::nth_element(sorted.begin(), place, sorted.end());
    image.full_scale = std::max(1.0f, *place);
  }
  return image;
}

}  // namespace sonar::clients
