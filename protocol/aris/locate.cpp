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

/// {offset, size} of the frame header in the first part.
std::optional<std::pair<std::size_t, std::size_t>> header_at(BytesView first_part) {
  if (first_part.empty()) return std::pair<std::size_t, std::size_t>{0, header_size};
  FramePart part;
  protobuf::read(first_part, part);
  if (!part.header || part.header->size() < header_size) return std::nullopt;
  return std::pair{static_cast<std::size_t>(part.header->data() - first_part.data()), part.header->size()};
}

}  // namespace

std::optional<Field> locate(FieldName name, BytesView first_part) {
  const auto at = header_at(first_part);
  auto found = wire::locate<FrameHeader>(header_name(name));
  if (!at || !found) return std::nullopt;
  found->offset += at->first;
  return found;
}

std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, BytesView first_part) {
  if (region == protocol::Region::bearings) return std::nullopt;  // a table of the ping mode
  if (first_part.empty()) return std::pair<std::size_t, std::size_t>{};
  const auto at = header_at(first_part);
  if (!at) return std::nullopt;
  const std::size_t end = at->first + at->second;
  if (region == protocol::Region::header) return std::pair{std::size_t{0}, at->first};
  if (region == protocol::Region::metadata) return *at;
  return std::pair{end, first_part.size() - end};
}

}  // namespace sonar::aris
