#include "protocol/blueview/encode_ping.hpp"

#include <algorithm>
#include <cassert>
#include <chrono>

#include "protocol/blueview/deflate.hpp"
#include "protocol/blueview/head_settings.hpp"
#include "protocol/blueview/models.hpp"
#include "protocol/blueview/options.hpp"

namespace sonar::blueview {
namespace {

constexpr std::uint8_t format_u16 = 1;
enum class Compression : std::uint8_t { none = 0, deflate = 1 };

double utc_seconds(Time t) { return std::chrono::duration<double>(t.time_since_epoch()).count(); }

void put_nav(wire::Bytes& out, const PingRequest& request) {
  const std::uint16_t present = nav_time | nav_depth | nav_pitch | nav_roll | nav_heading;
  const Pose& vehicle = request.vehicle_in_world;
  const RollPitchYaw angles = rpy_from_quat(vehicle.orientation);
  const Put write(out);
  write("nav_fields", present);
  write("time", utc_seconds(request.fired_at));
  write("depth", static_cast<float>(depth_from_z(vehicle.position_m.z)));
  write("pitch", static_cast<float>(-deg_from_rad(angles.pitch_rad)));  // about y to port, positive is bow down
  write("roll", static_cast<float>(deg_from_rad(angles.roll_rad)));     // about x ahead, positive lifts port
  write("heading", static_cast<float>(deg_from_rad(heading_rad(vehicle.orientation))));
}

/// Rows from the start range on, turned so that a beam's samples lie side by side. Little-endian already.
wire::Bytes beam_major(const Ping& ping, const HeadGrid& grid) {
  const auto beams = static_cast<std::size_t>(ping.request.settings.beam_count);
  const auto bins = static_cast<std::size_t>(grid.bins), skipped = static_cast<std::size_t>(grid.skipped);
  assert(ping.samples.size() == 2 * beams * (skipped + bins));
  wire::Bytes out(2 * beams * bins);
  constexpr std::size_t block = 32;  // square blocks: both sides stay in cache
  for (std::size_t j0 = 0; j0 < beams; j0 += block)
    for (std::size_t k0 = 0; k0 < bins; k0 += block)
      for (std::size_t j = j0; j < std::min(beams, j0 + block); ++j)
        for (std::size_t k = k0; k < std::min(bins, k0 + block); ++k) {
          const std::size_t from = 2 * ((skipped + k) * beams + j), to = 2 * (j * bins + k);
          out[to] = ping.samples[from];
          out[to + 1] = ping.samples[from + 1];
        }
  return out;
}

}  // namespace

wire::Bytes encode_ping(const Ping& ping, const protocol::DeviceState& device, const SonarSettings& settings) {
  const int index = ping.request.settings.mode;
  const HeadSettings& head = settings.heads[static_cast<std::size_t>(index)];
  const HeadGrid grid = grid_of(head, head_presets(device.model->profile)[static_cast<std::size_t>(index)].bin_m);
  const wire::Bytes samples = beam_major(ping, grid);
  wire::Bytes packed;
  if (text_option(device.options, option_name::compression) == "deflate") packed = deflated(samples);
  const Compression compression = packed.empty() ? Compression::none : Compression::deflate;
  const float half_deg = static_cast<float>(0.5 * deg_from_rad(static_cast<double>(ping.mode().horizontal_aperture_rad)));

  const wire::Bytes& body = packed.empty() ? samples : packed;
  wire::Bytes out;
  out.reserve(128 + body.size());
  const Put write(out);
  const int base = text_option(device.options, option_name::heads_base) == "1" ? 1 : 0;
  write("head", static_cast<std::int32_t>(index + base));
  write("number", static_cast<std::uint32_t>(ping.request.number));
  write("t_utc", utc_seconds(ping.request.fired_at));
  write("tz", std::int32_t{0});
  write("start", head.start_m);
  write("stop", static_cast<float>(static_cast<double>(head.start_m) + grid.bins * grid.bin_m));
  write("c", head.sound_speed_mps);
  write("fov_min", -half_deg);
  write("fov_max", half_deg);
  write("bin_m", static_cast<float>(grid.bin_m));
  write("beams", static_cast<std::uint16_t>(ping.request.settings.beam_count));
  write("bins", static_cast<std::uint16_t>(grid.bins));
  write("fmt", format_u16);
  write("compression", compression);
  put_nav(out, ping.request);
  write("raw_len", static_cast<std::uint32_t>(samples.size()));
  out.insert(out.end(), body.begin(), body.end());
  return out;
}

}  // namespace sonar::blueview
