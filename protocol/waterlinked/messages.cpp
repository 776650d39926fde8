#include "protocol/waterlinked/messages.hpp"

#include <snappy.h>
#include <zlib.h>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "waterlinked.pb.h"

namespace sonar::waterlinked {
namespace {

namespace pb = ::waterlinked::sonar::protocol;

void set_time(google::protobuf::Timestamp& to, Time at) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(at);
  to.set_seconds(whole.time_since_epoch().count());
  to.set_nanos(static_cast<std::int32_t>((at - whole).count()));
}
Time time_of(const google::protobuf::Timestamp& stamp) {
  return Time(std::chrono::seconds(stamp.seconds()) + std::chrono::nanoseconds(stamp.nanos()));
}

void set_shot(auto& m, const Shot& shot) {
  set_time(*m.mutable_header()->mutable_timestamp(), shot.at);
  m.mutable_header()->set_sequence_id(shot.sequence);
  m.set_speed_of_sound(shot.speed_of_sound_mps);
  m.set_range(shot.range_m);
  m.set_frequency(shot.frequency);
  m.set_width(shot.width);
  m.set_height(shot.height);
  m.set_fov_horizontal(shot.horizontal_deg);
  m.set_fov_vertical(shot.vertical_deg);
}
Shot shot_of(const auto& m) {
  return {time_of(m.header().timestamp()),
          m.header().sequence_id(),
          m.speed_of_sound(),
          m.range(),
          m.frequency(),
          m.width(),
          m.height(),
          m.fov_horizontal(),
          m.fov_vertical()};
}

Bytes packed(const auto& message) {
  pb::Packet packet;
  packet.mutable_msg()->PackFrom(message);
  const std::string text = packet.SerializeAsString();
  Bytes bytes(text.size());
  if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

}  // namespace

Bytes packet_of(const RangeMessage& message) {
  pb::RangeImage m;
  set_shot(m, message.shot);
  m.set_image_pixel_scale(message.pixel_scale_m);
  m.mutable_image_pixel_data()->Add(message.pixels.begin(), message.pixels.end());  // protobuf 3.12 has no Assign()
  return packed(m);
}

Bytes packet_of(const StrengthMessage& message) {
  pb::BitmapImageGreyscale8 m;
  set_shot(m, message.shot);
  m.set_image_pixel_data(message.pixels.data(), message.pixels.size());
  return packed(m);
}

// The vectors of all samples are in one list of floats, one after the other.
Bytes packet_of(const ImuMessage& message) {
  pb::ImuBatch m;
  m.set_batch_sequence_id(message.sequence);
  m.set_samples(static_cast<std::uint32_t>(message.samples.size()));
  for (const ImuMessage::Sample& sample : message.samples) {
    set_time(*m.add_timestamps(), sample.at);
    for (const float v : sample.specific_force_mps2) m.add_specific_force(v);
    for (const float v : sample.rate_radps) m.add_rate_of_turn(v);
  }
  return packed(m);
}

// A packet contains a google.protobuf.Any, whose type identifies one of the three messages.
Decoded decode(BytesView bytes) {
  Decoded out;
  pb::Packet packet;
  if (!packet.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return out;
  pb::RangeImage ranges;
  pb::BitmapImageGreyscale8 strengths;
  pb::ImuBatch imu;
  if (packet.msg().UnpackTo(&ranges)) {
    out.ranges = RangeMessage{
        shot_of(ranges), ranges.image_pixel_scale(), {ranges.image_pixel_data().begin(), ranges.image_pixel_data().end()}};
  } else if (packet.msg().UnpackTo(&strengths)) {
    out.strengths = StrengthMessage{shot_of(strengths), {}};
    for (const char c : strengths.image_pixel_data()) out.strengths->pixels.push_back(static_cast<std::uint8_t>(c));
  } else if (packet.msg().UnpackTo(&imu)) {
    out.imu = ImuMessage{imu.batch_sequence_id(), {}};
    const int samples = std::min({imu.timestamps_size(), imu.specific_force_size() / 3, imu.rate_of_turn_size() / 3});
    for (int i = 0; i < samples; ++i) {
      ImuMessage::Sample& sample = out.imu->samples.emplace_back();
      sample.at = time_of(imu.timestamps(i));
      for (int axis = 0; axis < 3; ++axis) {
        sample.specific_force_mps2[static_cast<std::size_t>(axis)] = imu.specific_force(3 * i + axis);
        sample.rate_radps[static_cast<std::size_t>(axis)] = imu.rate_of_turn(3 * i + axis);
      }
    }
  }
  return out;
}

namespace {

constexpr std::size_t head_bytes = 8, largest_content = 1 << 20;

std::string text_of(BytesView bytes) {
  std::string text(bytes.size(), '\0');
  if (!bytes.empty()) std::memcpy(text.data(), bytes.data(), bytes.size());
  return text;
}
Bytes bytes_of(const std::string& text) {
  Bytes bytes(text.size());
  if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

/// CRC-32 of IEEE 802.3, as zlib computes it.
std::uint32_t crc_of(BytesView bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, static_cast<const Bytef*>(static_cast<const void*>(bytes.data())), bytes.size()));
}

void append_u32(Bytes& out, std::uint32_t value) {
  for (int b = 0; b < 4; ++b) out.push_back(static_cast<std::byte>(value >> (8 * b) & 0xFF));
}
std::uint32_t u32_at(BytesView bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t b = 4; b-- > 0;) value = value << 8 | std::to_integer<std::uint32_t>(bytes[at + b]);
  return value;
}

constexpr double gravity_mps2 = 9.81;
constexpr std::chrono::nanoseconds imu_period = std::chrono::milliseconds(10);
constexpr std::chrono::nanoseconds longest_batch = std::chrono::seconds(1);  // bounds a batch after a pause of the acoustics

/// A pixel of both images. Where one of them has no return, such as a strength below the first pixel value, both have 0, so that
/// both images have returns at the same pixels.
struct Pixel {
  std::uint32_t range = 0;
  std::uint8_t strength = 0;
};
Pixel pixel_at(const Ping& ping, std::size_t i) {
  const RangePixel p = range_pixel(ping, i);
  const std::uint8_t strength = strength_pixel(p.strength);
  return p.range == 0 || strength == 0 ? Pixel{} : Pixel{p.range, strength};
}

Shot shot_of(const Ping& ping, const Settings& settings, const protocol::DeviceState& device) {
  const PingSettings& s = ping.request.settings;
  const ModeRow& mode = mode_rows()[settings.mode];
  Shot shot;
  shot.at = device_time(ping.request.fired_at, settings, device);
  shot.sequence = static_cast<std::uint32_t>(ping.request.number);
  shot.speed_of_sound_mps = s.device_sound_speed_mps;
  shot.range_m = static_cast<float>(s.range_m);
  // unknown: the field is named frequency, but a real unit sends its rate in it
  shot.frequency = static_cast<std::uint32_t>(mode.rate_hz);
  shot.width = columns;
  shot.height = rows;
  shot.horizontal_deg = static_cast<float>(mode.horizontal_deg);
  shot.vertical_deg = static_cast<float>(mode.vertical_deg);
  return shot;
}

std::array<float, 3> frd(Vec3d flu) {
  return {static_cast<float>(flu.x), static_cast<float>(-flu.y), static_cast<float>(-flu.z)};
}

}  // namespace

// The length is that of the whole packet. The CRC covers all bytes before it.
Bytes rip_packet(BytesView content, Rip version) {
  Bytes block(content.begin(), content.end());
  if (version == Rip::two) {
    const std::string plain = text_of(content);
    std::string packed;
    snappy::Compress(plain.data(), plain.size(), &packed);
    block = bytes_of(packed);
  }
  Bytes packet = bytes_of(version == Rip::two ? "RIP2" : "RIP1");
  append_u32(packet, static_cast<std::uint32_t>(block.size() + rip_overhead));
  packet.insert(packet.end(), block.begin(), block.end());
  append_u32(packet, crc_of(packet));
  return packet;
}

std::size_t rip_length(BytesView beginning) {
  if (beginning.size() < head_bytes) return 0;
  const std::string magic = text_of(beginning.first(4));
  const std::size_t length = u32_at(beginning, 4);
  return (magic == "RIP2" || magic == "RIP1") && length >= rip_overhead && length <= longest_rip ? length : 0;
}

std::optional<Bytes> rip_content(BytesView packet) {
  if (packet.empty() || rip_length(packet) != packet.size()) return std::nullopt;
  const bool packed = packet[3] == std::byte{'2'};  // "RIP2" has a Snappy block, "RIP1" the content itself
  const std::size_t crc_at = packet.size() - 4;
  if (u32_at(packet, crc_at) != crc_of(packet.first(crc_at))) return std::nullopt;
  const BytesView block = packet.subspan(head_bytes, crc_at - head_bytes);
  if (!packed) return Bytes(block.begin(), block.end());
  const std::string text = text_of(block);
  std::size_t size = 0;
  std::string plain;
  // The stated size is checked before it is allocated.
  if (!snappy::GetUncompressedLength(text.data(), text.size(), &size) || size > largest_content) return std::nullopt;
  if (!snappy::Uncompress(text.data(), text.size(), &plain)) return std::nullopt;
  return bytes_of(plain);
}

std::uint8_t strength_pixel(std::uint32_t linear) {
  if (linear <= 30) return 0;
  return static_cast<std::uint8_t>(std::clamp(std::lround(100 * std::log10(linear / 30.0)), 1L, 255L));
}

RangeMessage range_message(const Ping& ping, const Settings& settings, const protocol::DeviceState& device) {
  RangeMessage m{shot_of(ping, settings, device), static_cast<float>(pixel_scale_m), {}};
  for (std::size_t i = 0; i < ping.samples.size() / 4; ++i) m.pixels.push_back(pixel_at(ping, i).range);
  return m;
}

StrengthMessage strength_message(const Ping& ping, const Settings& settings, const protocol::DeviceState& device) {
  StrengthMessage m{shot_of(ping, settings, device), {}};
  for (std::size_t i = 0; i < ping.samples.size() / 4; ++i) m.pixels.push_back(pixel_at(ping, i).strength);
  return m;
}

/// Samples are taken at whole periods of the device's clock, independent of the time of the shot. A batch continues where the
/// previous one ended; after a pause, or initially, it begins one period of the mode before the shot.
ImuMessage imu_message(const Ping& ping, const Settings& settings, const protocol::DeviceState& device) {
  ImuMessage m;
  m.sequence = static_cast<std::uint32_t>(ping.request.number);
  const PingRequest& r = ping.request;
  const auto since_last = r.fired_at - device.framed_at;
  const bool goes_on = device.framed_at != Time{} && since_last.count() > 0 && since_last <= longest_batch;
  const auto period = nanoseconds_from(1 / static_cast<double>(mode_rows()[settings.mode].rate_hz));
  const Time shot = device_time(r.fired_at, settings, device);
  const Time from = shot - (goes_on ? since_last : period);
  for (Time at = from - from.time_since_epoch() % imu_period + imu_period; at <= shot; at += imu_period) {
    // The orientation is turned back by the rate of turn. The acceleration is not known and is assumed to be 0.
    const double before_s = -seconds(shot - at);
    const Quatd then = normalized(r.sonar_in_world.orientation * turned_by(before_s * r.sonar_moves.angular_rate_radps));
    m.samples.push_back({at, frd(rotate(conjugate(then), Vec3d{0, 0, gravity_mps2})), frd(r.sonar_moves.angular_rate_radps)});
  }
  return m;
}

std::vector<Bytes> encode_shot(const Ping& ping, const Settings& settings, const protocol::DeviceState& device) {
  const Rip rip = text_option(device.options, option_name::rip) == "1" ? Rip::one : Rip::two;
  std::vector<Bytes> datagrams{rip_packet(packet_of(range_message(ping, settings, device)), rip),
                               rip_packet(packet_of(strength_message(ping, settings, device)), rip)};
  if (settings.imu) datagrams.push_back(rip_packet(packet_of(imu_message(ping, settings, device)), rip));
  return datagrams;
}

}  // namespace sonar::waterlinked
