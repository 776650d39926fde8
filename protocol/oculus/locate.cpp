#include "protocol/oculus/locate.hpp"

#include "protocol/oculus/messages.hpp"

namespace sonar::oculus {
namespace {

/// For an empty `ping` it returns the layout with the most fields, which is that of version 2.
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

std::optional<protocol::Field> locate(protocol::Part part, protocol::FieldName name, wire::BytesView message) {
  if (part == protocol::Part::ping)
    return has_long_form(message) ? wire::locate<PingResultV2>(name, message) : wire::locate<PingResultV1>(name, message);
  return wire::locate<StatusMessage>(name, message);
}

std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, wire::BytesView ping) {
  if (ping.empty()) return std::pair<std::size_t, std::size_t>{};
  return has_long_form(ping) ? region_of<PingResultV2>(region, ping) : region_of<PingResultV1>(region, ping);
}

}  // namespace sonar::oculus
