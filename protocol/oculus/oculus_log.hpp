// The vendor's log files, .oculus version 1 (protocol/oculus/README.md, "Oculus log files"): a file header, then items, each a
// header of 40 bytes and a payload. An item of type 10 is a whole message; an item of type 1010 is the exact time of the previous
// item. The layout is that of the open-source readers.
#pragma once

#include <memory>

#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar::recording {

struct OculusLogHeader {
  std::uint32_t magic = 0x11223344, size = 48;
  std::array<char, 16> source{'O', 'c', 'u', 'l', 'u', 's'};
  std::uint16_t version = 1, encryption = 0;
  std::uint32_t pad = 0;
  std::int64_t key = 0;
  double created_unix_s = 0;
};
constexpr void fields(auto& visit, wire::Like<OculusLogHeader> auto& m) {
  visit("fileHeader", m.magic);
  visit("sizeHeader", m.size);
  visit("source", m.source);
  visit("version", m.version);
  visit("encryption", m.encryption);
  visit("pad", m.pad);
  visit("key", m.key);
  visit("time", m.created_unix_s);
}

struct OculusLogItem {
  std::uint32_t magic = 0xAABBCCDD, size = 40;
  std::uint16_t type = 0;
  std::uint16_t version = 0;  // unknown: the vendor's value; readers ignore it
  std::uint32_t pad0 = 0;
  double at_unix_s = 0;
  std::uint16_t compression = 0, pad1 = 0;  // 1 = zlib after a 4-byte big-endian length
  std::uint32_t original_size = 0, payload_size = 0, pad2 = 0;
};
constexpr void fields(auto& visit, wire::Like<OculusLogItem> auto& m) {
  visit("itemHeader", m.magic);
  visit("sizeHeader", m.size);
  visit("type", m.type);
  visit("version", m.version);
  visit("pad0", m.pad0);
  visit("time", m.at_unix_s);
  visit("compression", m.compression);
  visit("pad1", m.pad1);
  visit("originalSize", m.original_size);
  visit("payloadSize", m.payload_size);
  visit("pad2", m.pad2);
}

/// The exact time of the previous item.
struct OculusLogTime {
  std::uint64_t seconds = 0, nanoseconds = 0;  // time since 1970
};
constexpr void fields(auto& visit, wire::Like<OculusLogTime> auto& m) {
  visit("seconds", m.seconds);
  visit("nanoseconds", m.nanoseconds);
}

inline constexpr std::uint16_t oculus_message_item = 10, oculus_time_item = 1010;

static_assert(wire::wire_size<OculusLogHeader>() == 48);
static_assert(wire::wire_size<OculusLogItem>() == 40);

/// Reads a log of version 1. Errors: bad_data for another kind of file, a log of version 2, or an encrypted one.
Result<std::unique_ptr<RecordingReader>> read_oculus_log(std::unique_ptr<Source> source);
/// Writes the messages of the device's TCP stream; the format cannot store the bytes between messages.
std::unique_ptr<RecordingWriter> write_oculus_log(std::unique_ptr<Sink> sink);

}  // namespace sonar::recording
