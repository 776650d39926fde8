#include "protocol/oculus/locate.hpp"

#include <string_view>

#include "protocol/oculus/messages.hpp"

namespace sonar::oculus {
namespace {

using protocol::Field;
using protocol::FieldName;

/// The vendor's names; empty = none.
std::string_view header_name(FieldName name) {
  switch (name) {
    case FieldName::magic:
      return "header.oculusId";
    case FieldName::source_id:
      return "header.srcDeviceId";
    case FieldName::destination_id:
      return "header.dstDeviceId";
    case FieldName::message_type:
      return "header.msgId";
    case FieldName::version:
      return "header.msgVersion";
    case FieldName::payload_size:
      return "header.payloadSize";
    default:
      return {};
  }
}

std::string_view ping_name(FieldName name) {
  switch (name) {
    case FieldName::ping_id:
      return "pingId";
    case FieldName::ping_status:
      return "status";
    case FieldName::frequency:
      return "frequency";
    case FieldName::temperature:
      return "temperature";
    case FieldName::pressure:
      return "pressure";
    case FieldName::heading:
      return "heading";
    case FieldName::pitch:
      return "pitch";
    case FieldName::roll:
      return "roll";
    case FieldName::sound_speed:
      return "speedOfSoundUsed";
    case FieldName::time:
      return "pingStartTime";
    case FieldName::sample_type:
      return "dataSize";
    case FieldName::range_resolution:
      return "rangeResolution";
    case FieldName::rows:
      return "nRanges";
    case FieldName::beams:
      return "nBeams";
    case FieldName::image_offset:
      return "sizes.imageOffset";
    case FieldName::image_size:
      return "sizes.imageSize";
    case FieldName::message_size:
      return "sizes.messageSize";
    case FieldName::range:
      return "fire.range";
    case FieldName::ping_rate:
      return "fire.pingRate";
    case FieldName::gain:
      return "fire.gainPercent";
    case FieldName::part_number:
      return "header.partNumber";
    default:
      return header_name(name);
  }
}

std::string_view status_name(FieldName name) {
  switch (name) {
    case FieldName::device_id:
      return "deviceId";
    case FieldName::part_number:
      return "partNumber";
    case FieldName::device_status:
      return "status";
    case FieldName::address:
      return "ipAddr";
    case FieldName::netmask:
      return "ipMask";
    case FieldName::connected_address:
      return "connectedIpAddr";
    case FieldName::mac:
      return "macAddr";
    case FieldName::temperature:
      return "temperature";
    case FieldName::pressure:
      return "pressure";
    default:
      return header_name(name);
  }
}

/// Versions and dates of the three programs, which follow one another.
std::optional<Field> firmware(wire::BytesView message) {
  const auto first = wire::locate<StatusMessage>("firmwareVersion0", message);
  const auto last = wire::locate<StatusMessage>("bitfileDate", message);
  if (!first || !last) return std::nullopt;
  return Field{Field::Type::bytes, first->offset, last->offset + last->size - first->offset};
}

bool has_long_form(wire::BytesView ping) {
  MessageHeader header{.version = 2};
  wire::Reader reader(ping);
  if (!ping.empty()) fields(reader, header);
  return reader.ok() && header.version >= 2;
}

template <class Result>
std::optional<std::pair<std::size_t, std::size_t>> region_of(protocol::Region region, wire::BytesView ping) {
  Result head;
  wire::Reader reader(ping);
  fields(reader, head);
  std::pair<std::size_t, std::size_t> found{0, header_size};
  if (region != protocol::Region::header) {
    if (!reader.ok()) return std::nullopt;
    const std::size_t fixed_size = wire::wire_size<Result>();
    if (region == protocol::Region::metadata) found = {header_size, fixed_size - header_size};
    if (region == protocol::Region::bearings) found = {fixed_size, std::size_t{2} * head.beam_count};
    if (region == protocol::Region::image) found = {head.sizes.image_offset, head.sizes.image_size};
  }
  if (found.first + found.second > ping.size()) return std::nullopt;
  return found;
}

}  // namespace

std::optional<Field> locate(protocol::Part part, FieldName name, wire::BytesView message) {
  if (part == protocol::Part::ping)
    return has_long_form(message) ? wire::locate<PingResultV2>(ping_name(name), message)
                                  : wire::locate<PingResultV1>(ping_name(name), message);
  return name == FieldName::firmware ? firmware(message) : wire::locate<StatusMessage>(status_name(name), message);
}

std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, wire::BytesView ping) {
  if (ping.empty()) return std::pair<std::size_t, std::size_t>{};
  return has_long_form(ping) ? region_of<PingResultV2>(region, ping) : region_of<PingResultV1>(region, ping);
}

}  // namespace sonar::oculus
