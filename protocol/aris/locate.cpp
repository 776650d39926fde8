// Where the first datagram of a frame and the beacon have their fields. Integers of the part itself are varints, which have no
// fixed place; fields of the frame header do.
#include "protocol/aris/encode_frame.hpp"

namespace sonar::aris {
namespace {

using protocol::Field;
using protocol::FieldName;

std::string_view header_name(FieldName name) {
  switch (name) {
    case FieldName::version:
      return "Version";
    case FieldName::source_id:
      return "SonarSerialNumber";
    case FieldName::temperature:
      return "WaterTemp";
    case FieldName::pressure:
      return "Pressure";
    case FieldName::heading:
      return "CompassHeading";
    case FieldName::pitch:
      return "CompassPitch";
    case FieldName::roll:
      return "CompassRoll";
    case FieldName::sound_speed:
      return "SoundSpeed";
    case FieldName::time:
      return "FrameTime";
    case FieldName::sample_type:
      return "ReorderedSamples";
    case FieldName::rows:
      return "SamplesPerBeam";
    case FieldName::beams:
      return "PingMode";
    case FieldName::range:
      return "WindowLength";
    case FieldName::ping_rate:
      return "FrameRate";
    case FieldName::gain:
      return "ReceiverGain";
    default:
      return {};
  }
}

using Place = std::pair<std::size_t, std::size_t>;  // offset, size

Place place_of(BytesView inside, BytesView whole) {
  return {inside.empty() ? whole.size() : static_cast<std::size_t>(inside.data() - whole.data()), inside.size()};
}

/// Nothing: the part has no whole frame header.
std::optional<FramePart> first_of(BytesView first_part) {
  FramePart part;
  protobuf::read(first_part, part);
  return part.header && part.header->size() >= header_size ? std::optional(part) : std::nullopt;
}

}  // namespace

std::optional<Field> locate(FieldName name, BytesView first_part) {
  auto found = wire::locate<FrameHeader>(header_name(name));
  if (!found || first_part.empty()) return found;
  const auto part = first_of(first_part);
  if (!part) return std::nullopt;
  found->offset += place_of(*part->header, first_part).first;
  return found;
}

std::optional<Place> locate(protocol::Region region, BytesView first_part) {
  if (region == protocol::Region::bearings) return std::nullopt;  // a table of the ping mode
  if (first_part.empty()) return Place{};
  const auto part = first_of(first_part);
  if (!part) return std::nullopt;
  const Place header = place_of(*part->header, first_part);
  if (region == protocol::Region::header) return Place{0, header.first};
  return region == protocol::Region::metadata ? header : place_of(part->data, first_part);
}

}  // namespace sonar::aris
