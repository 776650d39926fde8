// Where a packet has the fields and regions that faults change.
#include "protocol/m3/packet.hpp"

namespace sonar::m3 {
namespace {

using Place = std::pair<std::size_t, std::size_t>;  // offset, size

std::string_view field_of(protocol::FieldName name) {
  using enum protocol::FieldName;
  switch (name) {
    case magic:
      return "head.sync";
    case message_type:
      return "head.data_type";
    case payload_size:
      return "head.body_size";
    case version:
      return "data.front.version";
    case source_id:
      return "data.front.sonar_id";
    case device_id:
      return "data.front.sonar_info";
    case time:
      return "data.front.time_s";
    case sound_speed:
      return "data.front.sound_speed";
    case rows:
      return "data.front.samples";
    case beams:
      return "data.front.beams";
    case range:
      return "data.front.far";
    case range_resolution:
      return "data.back.sample_interval";
    case frequency:
      return "data.back.frequency";
    case ping_id:
      return "data.back.ping_number";
    case ping_rate:
      return "data.back.ping_rate";
    case gain:
      return "data.back.gain.c";
    case heading:
      return "data.back.heading";
    case pitch:
      return "data.back.pitch";
    case roll:
      return "data.back.roll";
    case temperature:
      return "data.back.temperature";
    case device_status:
      return "data.back.head_status";
    default:
      return {};
  }
}

/// Offset and size of a region in a packet of that many bytes.
Place place_of(protocol::Region region, std::size_t size) {
  switch (region) {
    case protocol::Region::header:
      return {0, head_size};
    case protocol::Region::metadata:  // up to the table
      return {head_size, data_front_size};
    case protocol::Region::bearings:
      return {head_size + data_front_size, sizeof(float) * most_beams};
    case protocol::Region::image:
      return {samples_at, size - samples_at - foot_size};
  }
  return {};
}

}  // namespace

std::optional<protocol::Field> locate(protocol::FieldName name, BytesView packet) {
  const std::string_view field = field_of(name);
  return field.empty() ? std::nullopt : wire::locate<PacketFront>(field, packet);
}

std::optional<Place> locate(protocol::Region region, BytesView packet) {
  if (packet.empty()) return Place{};
  if (packet.size() < samples_at + foot_size) return std::nullopt;
  return place_of(region, packet.size());
}

}  // namespace sonar::m3
