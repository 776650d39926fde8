#pragma once

#include <string>
#include <string_view>

#include "protocol/dvl/dvl.hpp"
#include "protocol/dvl/measure.hpp"

namespace sonar::dvl::tests {

inline std::string text_of(protocol::BytesView bytes) {
  std::string text;
  for (const std::byte b : bytes) text += static_cast<char>(b);
  return text;
}
inline protocol::Bytes bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

inline protocol::DeviceState device(std::size_t model = 0) {
  protocol::DeviceState state;
  state.name = "dvl";
  state.id = 7001;
  state.model = models()[model];
  state.settings = vendor().initial_settings(state).vendor_settings;
  return state;
}

/// Returns a ping whose beams have echoes at these distances (0: no echo), of a device that looks down and whose vehicle heads
/// along the world's x axis.
inline Ping ping_of(const std::array<double, beam_count>& distances_m, const Settings& settings,
                    const protocol::DeviceState& state) {
  Ping ping;
  PingRequest& r = ping.request;
  r.model = state.model;
  r.number = PingNumber{1};
  r.fired_at = Time(std::chrono::seconds(1'700'000'000));
  r.sonar_in_world.orientation = quat_from_rpy({0, pi / 2, 0});
  r.water.sound_speed_mps = settings.speed_of_sound_mps;
  r.switches.noise = false;
  const protocol::ChangeSettings change = change_to(settings, state);
  r.settings = change.settings;
  r.vendor_settings = change.vendor_settings;
  ping.samples.resize(4u * grid_size * grid_size);
  const double unit_m = product_of(*state.model).range_unit_m;
  for (std::size_t beam = 0; beam < beam_count; ++beam) {
    const auto range = static_cast<std::uint32_t>(distances_m[beam] / unit_m + 0.5);
    const std::uint32_t code = RangePixel{range == 0 ? 0u : 3000u, range}.code();
    for (std::size_t b = 0; b < 4; ++b) ping.samples[4 * pixel_of(beam) + b] = static_cast<std::byte>(code >> (8 * b) & 0xFF);
  }
  return ping;
}

}  // namespace sonar::dvl::tests
