#include "tests/load/premade_engine.hpp"

namespace sonar::load {

std::span<const std::byte> picture_of(std::uint32_t number) {
  static const auto all = [] {
    std::vector<std::vector<std::byte>> made(pictures, std::vector<std::byte>(picture_bytes));
    std::uint32_t state = 1;
    for (auto& picture : made)
      for (std::byte& sample : picture) sample = static_cast<std::byte>((state = state * 1664525u + 1013904223u) >> 25);
    return made;
  }();
  return all[number % pictures];
}

std::vector<Ping> PremadeEngine::run(std::span<const PingRequest> requests) {
  std::vector<Ping> made;
  for (const PingRequest& request : requests) {
    Ping ping;
    ping.request = request;
    ping.request.settings.beam_count = static_cast<int>(beams);
    ping.request.settings.range_bin_count = static_cast<int>(rows);
    for (std::size_t b = 0; b < beams; ++b) ping.beam_azimuth_rad.push_back(1.0f - 2.0f * static_cast<float>(b) / (beams - 1));
    const auto picture = picture_of(static_cast<std::uint32_t>(request.number));
    ping.samples.assign(picture.begin(), picture.end());
    made.push_back(std::move(ping));
  }
  return made;
}

}  // namespace sonar::load
