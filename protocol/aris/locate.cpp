// Finds fields in the first datagram of a frame and in the beacon. Fields of the frame header have a fixed place. Integers of
// the protobuf messages are varints, whose place and size depend on other values; to change one, the message is decoded and
// encoded again.
#include <algorithm>

#include "protocol/aris/encode_frame.hpp"

namespace sonar::aris {
namespace {

using protocol::Field;
using protocol::FieldName;

constexpr std::int64_t too_hot = 0x4000, stopped_by_heat = 0x8000;  // status bits of an Oculus, which faults use

using Place = std::pair<std::size_t, std::size_t>;  // offset, size

Place place_of(BytesView inside, BytesView whole) {
  return {inside.empty() ? whole.size() : static_cast<std::size_t>(inside.data() - whole.data()), inside.size()};
}

/// The first part of a frame; nothing if the part has no frame header.
std::optional<FramePart> first_of(BytesView first_part) {
  FramePart part;
  return protobuf::read(first_part, part) && part.header ? std::optional(part) : std::nullopt;
}

}  // namespace

// For an empty message the result is the position within the frame header, as Vendor::field() requires.
std::optional<Field> locate(FieldName name, BytesView first_part) {
  auto found = wire::locate<FrameHeader>(name);
  if (!found || first_part.empty()) return found;
  const auto part = first_of(first_part);
  if (!part || found->offset + found->size > part->header->size()) return std::nullopt;
  found->offset += place_of(*part->header, first_part).first;
  return found;
}

std::optional<Place> locate(protocol::Region region, BytesView first_part) {
  if (region == protocol::Region::bearings) return std::nullopt;  // frames have no table: the ping mode determines the bearings
  if (first_part.empty()) return Place{};
  const auto part = first_of(first_part);
  if (!part) return std::nullopt;
  const Place header = place_of(*part->header, first_part);
  if (region == protocol::Region::header) return Place{0, header.first};
  return region == protocol::Region::metadata ? header : place_of(part->data, first_part);
}

bool change_part(FieldName name, const std::function<std::int64_t(std::int64_t)>& change, Bytes& bytes) {
  if (name != FieldName::ping_id && name != FieldName::image_size) return false;
  FramePart part;
  if (bytes.empty() || !protobuf::read(bytes, part)) return bytes.empty();
  Bytes header = part.header ? Bytes(part.header->begin(), part.header->end()) : Bytes{};
  if (part.header) part.header = header;
  if (name == FieldName::image_size) {
    part.total_size = static_cast<std::int32_t>(change(part.total_size));
  } else {
    // Two fields hold the number: frame_index of the part counts from 1, FrameIndex of the header from 0.
    part.frame_index = static_cast<std::int32_t>(change(part.frame_index - 1) + 1);
    const auto number = static_cast<std::uint32_t>(part.frame_index - 1);
    Bytes index;
    wire::Writer write(index);
    write("FrameIndex", number);
    if (header.size() >= index.size()) std::copy(index.begin(), index.end(), header.begin());
  }
  bytes = protobuf::bytes_of(part);
  return true;
}

bool change_beacon(FieldName name, const std::function<std::int64_t(std::int64_t)>& change, Bytes& bytes) {
  const bool known = name == FieldName::device_id || name == FieldName::connected_address || name == FieldName::device_status;
  Availability a;
  if (!known || bytes.empty() || !protobuf::read(bytes, a)) return known && bytes.empty();
  if (name == FieldName::device_id) {
    a.serial = static_cast<std::uint32_t>(change(a.serial));
  } else if (name == FieldName::connected_address) {
    a.busy = change(a.busy) != 0;
  } else {
    // An ARIS has no status word. The bits that faults set in that of an Oculus become the fields with the same meaning.
    const std::int64_t status = change(0);
    if (status & (too_hot | stopped_by_heat)) a.cpu_c = a.hot_limit_c + 2;
    if (status & stopped_by_heat) a.power_down_reason = 0;
  }
  bytes = protobuf::bytes_of(a);
  return true;
}

}  // namespace sonar::aris
