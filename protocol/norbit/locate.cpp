// Locates the fields and regions of packets that faults change. A message is one packet, or both of a ping, bathymetry first.
#include "protocol/norbit/packet.hpp"

namespace sonar::norbit {
namespace {

using Place = std::pair<std::size_t, std::size_t>;  // offset, size

/// nullopt if the bytes do not begin with a header.
std::optional<Header> header_of(BytesView bytes) {
  Header header;
  wire::Reader reader(bytes);
  fields(reader, header);
  return reader.ok() ? std::optional(header) : std::nullopt;
}

template <class Front>
std::optional<protocol::Field> in_packet(protocol::FieldName name, BytesView packet) {
  const auto found = wire::locate<Header>(name, packet);
  return found ? found : wire::locate<Front>(name, packet, header_size);
}

}  // namespace

std::optional<protocol::Field> locate(protocol::FieldName name, BytesView packets) {
  if (packets.empty()) return in_packet<ColumnFront>(name, {});  // the packet with the most fields
  const auto header = header_of(packets);
  if (!header) return std::nullopt;
  if (header->type == Type::column) return in_packet<ColumnFront>(name, packets);
  auto found = in_packet<BathymetryFront>(name, packets);
  if (found || packets.size() <= header->size || header->size <= header_size) return found;
  found = in_packet<ColumnFront>(name, packets.subspan(header->size));
  if (found) found->offset += header->size;
  return found;
}

std::optional<Place> locate(protocol::Region region, BytesView packets) {
  using protocol::Region;
  if (packets.empty()) return Place{};
  const auto header = header_of(packets);
  if (!header || header->size <= header_size || header->size > packets.size()) return std::nullopt;
  if (region == Region::header) return Place{0, header_size};
  if (header->type == Type::bathymetry) {
    constexpr std::size_t beams_at = header_size + bathymetry_front_size;
    if (header->size < beams_at) return std::nullopt;
    if (region == Region::metadata) return Place{header_size, bathymetry_front_size};
    if (packets.size() == header->size)
      return region == Region::image ? std::optional(Place{beams_at, header->size - beams_at}) : std::nullopt;
    const auto found = locate(region, packets.subspan(header->size));
    return found ? std::optional(Place{found->first + header->size, found->second}) : std::nullopt;
  }
  constexpr std::size_t pixels_at = header_size + column_front_size;
  const auto beams = wire::locate<ColumnFront>(means::beams, packets, header_size);
  if (!beams || header->size < pixels_at) return std::nullopt;
  if (region == Region::metadata) return Place{header_size, column_front_size};
  std::uint32_t count = 0;
  wire::Reader reader(packets.subspan(beams->offset));
  reader("N", count);
  const std::size_t directions = sizeof(float) * std::size_t{count};
  if (directions > header->size - pixels_at) return std::nullopt;
  return region == Region::bearings ? Place{header->size - directions, directions}
                                    : Place{pixels_at, header->size - directions - pixels_at};
}

}  // namespace sonar::norbit
