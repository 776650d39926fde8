// Fuzzes datagrams of MAVLink, one after another over one link. The first byte selects the settings. Then a length of two bytes
// and a datagram follow repeatedly. Frames of known messages that are otherwise valid get the right checksum, because hardly any
// mutation would pass this check. All results are usable, for any input.
#include <cmath>

#include "protocol/mavlink/mavlink_poses.hpp"
#include "tests/fuzz/byte_script.hpp"

namespace {

using namespace sonar;

/// Corrects the checksums of version 2 frames at the start of a datagram.
void mend(mavlink::Bytes& datagram) {
  std::size_t at = 0;
  while (at + 12 <= datagram.size() && datagram[at] == std::byte{0xFD}) {
    const std::size_t behind = at + 10 + std::to_integer<std::size_t>(datagram[at + 1]);
    const auto* message = mavlink::find_message(std::to_integer<std::uint32_t>(datagram[at + 7]) |
                                                std::to_integer<std::uint32_t>(datagram[at + 8]) << 8);
    if (behind + 2 > datagram.size() || message == nullptr || datagram[at + 9] != std::byte{0}) return;
    const auto crc = mavlink::checksum(std::array{std::byte{message->crc_extra}},
                                       mavlink::checksum(std::span(datagram).subspan(at + 1, behind - at - 1)));
    datagram[behind] = static_cast<std::byte>(crc & 0xFF);
    datagram[behind + 1] = static_cast<std::byte>(crc >> 8);
    at = behind + 2;
  }
}

void judge(const mavlink::Reaction& reaction) {
  for (const mavlink::SourcedPose& p : reaction.poses) {
    fuzz::require(is_finite(p.sample.pose.position_m) && is_finite(p.sample.pose.orientation));
    fuzz::require(std::abs(norm_squared(p.sample.pose.orientation) - 1) < 1e-9);
    fuzz::require(std::abs(p.sample.stamp.ns) <= control::largest_stamp_ns);
    fuzz::require(!p.sample.velocity_mps || is_finite(*p.sample.velocity_mps));
    fuzz::require(!p.source.empty());
  }
  for (const std::string& r : reaction.refusals) fuzz::require(!r.empty());
  for (const mavlink::Bytes& reply : reaction.replies) {  // our own replies are valid
    mavlink::FrameReader frames(reply);
    while (frames.next()) continue;
    fuzz::require(frames.counts().frames + frames.counts().unknown == 1 && frames.counts().junk_bytes == 0);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  mavlink::Settings settings;
  if ((data[0] & 1) != 0) settings.origin = Geodetic{rad_from_deg(47.6), rad_from_deg(-122.33), 0};
  settings.request_rates = (data[0] & 2) != 0;
  if ((data[0] & 4) != 0) settings.system_id = 1;
  mavlink::MavlinkPoses poses(settings);
  std::size_t at = 1;
  Time now{};
  while (at + 2 <= size) {
    const std::size_t length = std::min<std::size_t>(data[at] + 256u * data[at + 1], size - at - 2);
    const auto bytes = std::as_bytes(std::span(data + at + 2, length));
    mavlink::Bytes datagram(bytes.begin(), bytes.end());
    mend(datagram);
    judge(poses.on_datagram(datagram, now));
    judge(poses.on_tick(now));
    now += std::chrono::milliseconds(300);
    at += 2 + length;
  }
  const mavlink::FrameCounts& c = poses.counts();
  fuzz::require(c.frames * 12 <= size && c.junk_bytes <= size);
  return 0;
}
