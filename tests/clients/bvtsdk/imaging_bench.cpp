// Measures how long images, their colours and range lists take, from a ping of speckle (768 beams x 2400 rows, 130 degrees,
// 30 m) on one thread. Prints the best, the median and the first of 41 times, in milliseconds.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "clients/bvtsdk/core/colour_maps.hpp"
#include "clients/bvtsdk/core/imaging.hpp"
#include "clients/bvtsdk/core/range_list.hpp"
#include "tests/clients/bvtsdk/made_ping.hpp"

using namespace sonar::bvt;

namespace {

template <class F>
void report(const char* what, const F& run) {
  std::vector<double> ms;
  for (int i = 0; i < 41; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    run();
    ms.push_back(1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  const double first = ms.front();
  std::sort(ms.begin(), ms.end());
  std::printf("%-44s best %6.2f ms  median %6.2f ms  first %6.2f ms\n", what, ms.front(), ms[ms.size() / 2], first);
}

}  // namespace

int main() {
  std::uint32_t state = 1;
  PolarPing ping = make_ping(768, 2400, 0.5f, 0.0125f, [&](int, int) {
    state = state * 1664525u + 1013904223u;
    return static_cast<int>(state >> 17);
  });
  ping.fov_min_deg = -65;
  ping.fov_max_deg = 65;
  Imager imager;
  MagImage image;
  ImageSettings settings;
  report("XY, automatic", [&] { imager.make(ping, ImageType::xy, settings, image); });
  std::printf("  %d x %d pixels\n", image.width, image.height);
  settings.resolution = ImageRes::high;
  report("XY, high", [&] { imager.make(ping, ImageType::xy, settings, image); });
  std::printf("  %d x %d pixels\n", image.width, image.height);
  settings.resolution = ImageRes::automatic;
  settings.noise_threshold = 0.1f;
  report("XY, noise threshold", [&] { imager.make(ping, ImageType::xy, settings, image); });
  settings.noise_threshold = 0;
  settings.filter_flags = mean_3x3;
  report("XY, mean 3 x 3", [&] { imager.make(ping, ImageType::xy, settings, image); });
  settings.filter_flags = mean_9x2;
  report("XY, mean 9 x 2", [&] { imager.make(ping, ImageType::xy, settings, image); });
  settings.filter_flags = no_filter;
  report("R-Theta, automatic", [&] { imager.make(ping, ImageType::r_theta, settings, image); });
  std::printf("  %d x %d pixels\n", image.width, image.height);
  ColourMapper mapper;
  mapper.use(make_colour_map("jet"));
  ColourImage colours;
  report("R-Theta, colours", [&] { mapper.map(image, colours); });
  RangeList list;
  report("range list", [&] { make_range_list(ping, {}, list); });
  const Bytes payload = encode_ping(ping);
  report("decoding the ping", [&] { decode_ping(payload); });
  return 0;
}
