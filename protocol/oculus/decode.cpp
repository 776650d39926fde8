#include "protocol/oculus/decode.hpp"

#include <algorithm>

#include "core/base/geometry.hpp"

namespace sonar::oculus {
namespace {

PingHead head_from(const PingResultV1& from) {
  PingHead head;
  PingResultV2& to = head.fixed;
  to.header = from.header;
  to.fire = from.fire;
  to.ping_id = from.ping_id;
  to.status = from.status;
  to.frequency_hz = from.frequency_hz;
  to.temperature_c = from.temperature_c;
  to.pressure_bar = from.pressure_bar;
  to.sound_speed_mps = from.sound_speed_mps;
  head.ping_start_counter = from.ping_start_time;
  to.data_size = from.data_size;
  to.range_resolution_m = from.range_resolution_m;
  to.row_count = from.row_count;
  to.beam_count = from.beam_count;
  to.sizes = from.sizes;
  return head;
}

std::size_t gain_bytes(const PingResultV2& fixed) { return (fixed.fire.flags & flag::row_gains) != 0 ? 4 : 0; }

std::size_t row_bytes(const DecodedPing& ping) {
  return gain_bytes(ping.head.fixed) + std::size_t{ping.head.fixed.beam_count} * ping.bytes_per_sample();
}

/// Returns an unsigned number of 1 to 4 bytes; the caller must check that the bytes exist.
std::uint32_t unsigned_at(const wire::Bytes& bytes, std::size_t offset, std::size_t size) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value |= std::to_integer<std::uint32_t>(bytes[offset + i]) << (8 * i);
  return value;
}

// A ping that states more data than it has is decoded as far as possible, so that identity_violations() can report the mistake.
void read_bearings(DecodedPing& ping, wire::Reader& reader) {
  const std::size_t count = std::min<std::size_t>(ping.head.fixed.beam_count, reader.remaining() / 2);
  ping.bearings_cdeg.resize(count);
  for (std::int16_t& bearing : ping.bearings_cdeg) reader("bearing", bearing);
}

void locate_image(DecodedPing& ping) {
  const PingResultV2& fixed = ping.head.fixed;
  if (fixed.data_size > DataSize::bits32) return;
  const std::size_t needed = row_bytes(ping) * fixed.row_count;  // at most 65535 * (65535 * 4 + 4): fits 64 bits
  ping.has_image = fixed.sizes.image_offset <= ping.message.size() && needed <= ping.message.size() - fixed.sizes.image_offset &&
                   ping.bearings_cdeg.size() == fixed.beam_count;
  if (!ping.has_image || gain_bytes(fixed) == 0) return;
  for (std::size_t row = 0; row < ping.rows(); ++row)
    ping.row_gains.push_back(unsigned_at(ping.message, fixed.sizes.image_offset + row * row_bytes(ping), 4));
}

OtherMessage unreadable(const MessageHeader& header, std::size_t size, std::string why) { return {header, size, std::move(why)}; }

}  // namespace

std::size_t DecodedPing::bytes_per_sample() const { return static_cast<std::size_t>(head.fixed.data_size) + 1; }

wire::BytesView DecodedPing::row_samples(std::size_t row) const {
  const std::size_t start = head.fixed.sizes.image_offset + row * row_bytes(*this) + gain_bytes(head.fixed);
  return wire::BytesView(message).subspan(start, beams() * bytes_per_sample());
}

std::uint32_t DecodedPing::sample(std::size_t row, std::size_t beam) const {
  const std::size_t start = head.fixed.sizes.image_offset + row * row_bytes(*this) + gain_bytes(head.fixed);
  return unsigned_at(message, start + beam * bytes_per_sample(), bytes_per_sample());
}

double DecodedPing::azimuth_rad(std::size_t beam) const { return -rad_from_deg(bearings_cdeg[beam] / 100.0); }

double DecodedPing::row_range_m(std::size_t row) const {
  return (static_cast<double>(row) + 0.5) * head.fixed.range_resolution_m;
}

std::optional<DecodedPing> decode_ping(wire::BytesView message) {
  wire::Reader reader(message);
  DecodedPing ping;
  if (message.size() >= header_size && header_of(message).version >= 2) {
    fields(reader, ping.head.fixed);
  } else {
    PingResultV1 short_form;
    fields(reader, short_form);
    ping.head = head_from(short_form);
  }
  if (!reader.ok()) return std::nullopt;
  ping.message.assign(message.begin(), message.end());
  read_bearings(ping, reader);
  locate_image(ping);
  ping.violations = identity_violations(ping);
  return ping;
}

Received decode_message(wire::BytesView message) {
  const MessageHeader header = header_of(message);
  switch (header.type) {
    case MessageType::ping_result: {
      if (auto ping = decode_ping(message)) return std::move(*ping);
      return unreadable(header, message.size(), "a ping result shorter than its fixed part");
    }
    case MessageType::dummy:
      return DummyMessage{header};
    case MessageType::user_config: {
      UserConfigMessage config;
      wire::Reader reader(message);
      fields(reader, config);
      if (reader.ok()) return config;
      return unreadable(header, message.size(), "a user configuration whose " + reader.failure_text());
    }
    case MessageType::log: {
      LogText log{header, {}};
      for (const std::byte b : message.subspan(header_size)) log.text.push_back(static_cast<char>(b));
      return log;
    }
    default:
      return unreadable(header, message.size(), "a message type that drivers do not read");
  }
}

Result<StatusMessage> decode_status(wire::BytesView datagram) {
  StatusMessage status;
  wire::Reader reader(datagram);
  fields(reader, status);
  if (!reader.ok()) return failure(ErrorKind::bad_data, "status datagram too short: " + reader.failure_text());
  if (status.header.oculus_id != magic) return failure(ErrorKind::bad_data, "datagram does not start with the Oculus id 53 4F");
  return status;
}

std::optional<Received> Decoder::next() {
  const auto message = framer_.next();
  if (!message) return std::nullopt;
  return decode_message(*message);
}

}  // namespace sonar::oculus
