// Finds in a packet the fields and regions that faults change.
#include "protocol/m3/packet.hpp"

namespace sonar::m3 {
namespace {

using Place = std::pair<std::size_t, std::size_t>;  // offset, size

/// Offset and size of a region in a packet of that many bytes.
Place place_of(protocol::Region region, std::size_t size) {
  switch (region) {
    case protocol::Region::header:
      return {0, head_size};
    case protocol::Region::metadata:  // the data header up to the table of bearings
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
  return wire::locate<PacketFront>(name, packet);
}

std::optional<Place> locate(protocol::Region region, BytesView packet) {
  if (packet.empty()) return Place{};
  if (packet.size() < samples_at + foot_size) return std::nullopt;
  return place_of(region, packet.size());
}

}  // namespace sonar::m3
