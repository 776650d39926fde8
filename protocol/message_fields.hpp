// Names, common to all makes, of the fields and regions of messages that faults can change.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace sonar::protocol {

/// The meaning of a message's field, independent of the vendor's name.
enum class FieldName {
  magic,
  source_id,
  destination_id,
  message_type,
  version,
  payload_size,
  ping_id,
  ping_status,
  frequency,
  temperature,
  pressure,
  heading,
  pitch,
  roll,
  sound_speed,
  time,
  sample_type,
  range_resolution,
  rows,
  beams,
  image_offset,
  image_size,
  message_size,
  range,
  ping_rate,
  gain,
  device_id,
  part_number,
  device_status,
  firmware,
  address,
  netmask,
  connected_address,
  mac,
};
/// fields() of a message states the meaning of a field with such a name: visit("pingId", m.ping_id, means::ping_id).
namespace means {
using enum FieldName;
}
/// The names of FieldName for users, in the order of the enum.
inline constexpr std::array<std::string_view, 34> field_names{
    "magic",     "source_id",   "destination_id",    "message_type", "version",       "payload_size",
    "ping_id",   "ping_status", "frequency",         "temperature",  "pressure",      "heading",
    "pitch",     "roll",        "sound_speed",       "time",         "sample_type",   "range_resolution",
    "rows",      "beams",       "image_offset",      "image_size",   "message_size",  "range",
    "ping_rate", "gain",        "device_id",         "part_number",  "device_status", "firmware",
    "address",   "netmask",     "connected_address", "mac"};
static_assert(field_names.size() == static_cast<std::size_t>(FieldName::mac) + 1);

/// A kind of message. `ping` is the message of a ping that a client receives, prefix included.
enum class Part { ping, beacon };
/// Regions of a ping: the header that every message has, the other fields, the table of the beams' directions, the samples.
enum class Region { header, metadata, bearings, image };
inline constexpr std::array<std::string_view, 4> region_names{"header", "metadata", "bearings", "image"};

}  // namespace sonar::protocol
