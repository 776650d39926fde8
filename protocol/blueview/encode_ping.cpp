#include "protocol/blueview/encode_ping.hpp"

#include <algorithm>
#include <cassert>
#include <chrono>

#include "protocol/blueview/models.hpp"

namespace sonar::blueview {
namespace {

/// A PING_DATA message up to the samples, for locate().
struct PingMessage {
  FrameHeader header;
  PingHead ping;
};
constexpr void fields(auto& visit, wire::Like<PingMessage> auto& m) {
  visit("header", m.header);
  visit("ping", m.ping);
}

double utc_seconds(Time t) { return std::chrono::duration<double>(t.time_since_epoch()).count(); }

void set_nav(PingHead& to, const PingRequest& request) {
  const Pose& vehicle = request.vehicle_in_world;
  const RollPitchYaw angles = rpy_from_quat(vehicle.orientation);
  to.nav_time_s = utc_seconds(request.fired_at);
  to.depth_m = static_cast<float>(depth_from_z(vehicle.position_m.z));
  to.pitch_deg = static_cast<float>(-deg_from_rad(angles.pitch_rad));  // a positive pitch_rad is bow down
  to.roll_deg = static_cast<float>(deg_from_rad(angles.roll_rad));     // a positive roll_rad is port up
  to.heading_deg = static_cast<float>(deg_from_rad(heading_rad(vehicle.orientation)));
}

/// Returns the samples from the start range on, transposed from row by row to beam by beam. They are little-endian in both
/// orders.
wire::Bytes beam_major(const Ping& ping, const HeadGrid& grid) {
  const auto beams = static_cast<std::size_t>(ping.request.settings.beam_count);
  const auto bins = static_cast<std::size_t>(grid.bins), skipped = static_cast<std::size_t>(grid.skipped);
  assert(ping.samples.size() == 2 * beams * (skipped + bins));
  wire::Bytes out(2 * beams * bins);
  constexpr std::size_t block = 32;  // square blocks, so that both the source rows and the target beams stay in cache
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
  const wire::Bytes& body = packed.empty() ? samples : packed;  // deflated() returns an empty buffer if zlib has no memory
  const float half_deg = static_cast<float>(0.5 * deg_from_rad(static_cast<double>(ping.mode().horizontal_aperture_rad)));
  const int base = text_option(device.options, option_name::heads_base) == "1" ? 1 : 0;

  PingHead fixed;
  fixed.head = static_cast<std::int32_t>(index + base);
  fixed.number = static_cast<std::uint32_t>(ping.request.number);
  fixed.utc_s = utc_seconds(ping.request.fired_at);
  fixed.start_m = head.start_m;
  fixed.stop_m = static_cast<float>(static_cast<double>(head.start_m) + grid.bins * grid.bin_m);
  fixed.sound_speed_mps = head.sound_speed_mps;
  fixed.fov_min_deg = -half_deg;
  fixed.fov_max_deg = half_deg;
  fixed.bin_m = static_cast<float>(grid.bin_m);
  fixed.beams = static_cast<std::uint16_t>(ping.request.settings.beam_count);
  fixed.bins = static_cast<std::uint16_t>(grid.bins);
  fixed.compression = packed.empty() ? Compression::none : Compression::deflate;
  set_nav(fixed, ping.request);
  fixed.raw_length = static_cast<std::uint32_t>(samples.size());
  wire::Bytes out;
  out.reserve(wire::wire_size<PingHead>() + body.size());
  wire::append(out, fixed);
  out.insert(out.end(), body.begin(), body.end());
  return out;
}

std::optional<protocol::Field> locate(protocol::FieldName name, wire::BytesView ping) {
  return wire::locate<PingMessage>(name, ping);
}

std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, wire::BytesView ping) {
  if (region == protocol::Region::bearings) return std::nullopt;  // beams are equally spaced between fov_min and fov_max
  if (ping.empty()) return std::pair<std::size_t, std::size_t>{};
  const std::size_t image_at = wire::wire_size<PingMessage>();
  const std::size_t end = region == protocol::Region::header ? header_size : image_at;
  if (ping.size() < end) return std::nullopt;
  if (region == protocol::Region::header) return std::pair{std::size_t{0}, header_size};
  if (region == protocol::Region::metadata) return std::pair{header_size, image_at - header_size};
  return std::pair{image_at, ping.size() - image_at};
}

}  // namespace sonar::blueview
