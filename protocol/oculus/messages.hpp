// Every Oculus message, described once in wire order: members have our names, fields() has the vendor's names. Little-endian,
// byte-packed, sent over TCP 52100 in both directions and (status) over UDP 52102; see protocol/oculus/README.md. Layouts:
// docs/protocols/oculus.md and the sources named there; captured pings confirm header and version-1 result.
#pragma once

#include "protocol/message_fields.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::oculus {

namespace means = protocol::means;

inline constexpr std::uint16_t magic = 0x4F53;  // bytes 53 4F
inline constexpr std::uint16_t tcp_port = 52100, status_port = 52102;
inline constexpr std::uint32_t image_offset = 2048;  // from captures; in both versions the image follows the table of bearings
inline constexpr std::uint32_t request_payload_limit = 4096;  // a larger payload size from a client is junk
inline constexpr std::size_t reply_limit = 4u << 20;  // a longer message from a device is junk: the largest real ping has 1.5 MB

enum class MessageType : std::uint16_t {
  status = 0x0001,
  fire = 0x0015,
  full_ping_result = 0x0022,  // never sent: the answer to the non-public full fire message
  ping_result = 0x0023,
  user_config = 0x0055,
  log = 0x0080,
  dummy = 0x00FF,
};

/// Maximum ping rates. Other values occur on the wire (the captured echo has 195) and are kept.
enum class PingRate : std::uint8_t { hz10 = 0, hz15 = 1, hz40 = 2, hz5 = 3, hz2 = 4, standby = 5 };
enum class DataSize : std::uint8_t { bits8 = 0, bits16 = 1, bits24 = 2, bits32 = 3 };

namespace flag {
inline constexpr std::uint8_t range_in_metres = 0x01, samples_16_bit = 0x02, row_gains = 0x04, simple_result = 0x08;
inline constexpr std::uint8_t gain_assist = 0x10, low_power = 0x20, beams_512 = 0x40, network_trigger = 0x80;
inline constexpr std::uint32_t extended_32_bit = 0x200;  // "scientific" data (liboculus)
}  // namespace flag

struct MessageHeader {
  std::uint16_t oculus_id = magic, source = 0, destination = 0;
  MessageType type{};
  std::uint16_t version = 0;
  std::uint32_t payload_size = 0;  // unreliable in messages of clients, which often send 0
  std::uint16_t part_number = 0;   // 0 except in the status message
};
constexpr void fields(auto& visit, wire::Like<MessageHeader> auto& m) {
  visit("oculusId", m.oculus_id, means::magic);
  visit("srcDeviceId", m.source, means::source_id);
  visit("dstDeviceId", m.destination, means::destination_id);
  visit("msgId", m.type, means::message_type);
  visit("msgVersion", m.version, means::version);
  visit("payloadSize", m.payload_size, means::payload_size);
  visit("partNumber", m.part_number, means::part_number);
}

/// The settings that a client requests; every ping echoes the same bytes.
struct FireSettings {
  std::uint8_t mode = 1;  // 1 low frequency, 2 high frequency
  PingRate ping_rate = PingRate::hz10;
  std::uint8_t network_speed = 0xFF;  // Mbit/s; 0 and 255 = no limit
  std::uint8_t gamma = 0x7F;          // gamma = value / 255; 0 means 1.0
  std::uint8_t flags = 0;
  double range = 0;  // m or per cent of the mode's maximum
  double gain_percent = 0;
  double sound_speed_mps = 0;  // 0 = the device computes the sound speed
  double salinity_ppt = 0;
};
constexpr void fields(auto& visit, wire::Like<FireSettings> auto& m) {
  visit("masterMode", m.mode);
  visit("pingRate", m.ping_rate, means::ping_rate);
  visit("networkSpeed", m.network_speed);
  visit("gammaCorrection", m.gamma);
  visit("flags", m.flags);
  visit("range", m.range, means::range);
  visit("gainPercent", m.gain_percent, means::gain);
  visit("speedOfSound", m.sound_speed_mps);
  visit("salinity", m.salinity_ppt);
}

/// The fields that version 2 adds to the fire message.
struct FireExtension {
  std::uint32_t flags = 0;
  std::array<std::uint32_t, 2> reserved0{};
  std::uint32_t beacon_locator_frequency = 0;
  std::array<std::uint32_t, 5> reserved1{};
};
constexpr void fields(auto& visit, wire::Like<FireExtension> auto& m) {
  visit("extFlags", m.flags);
  visit("reserved0", m.reserved0);
  visit("beaconLocatorFrequency", m.beacon_locator_frequency);
  visit("reserved1", m.reserved1);
}

struct FireMessageV1 {  // versions 0 and 1
  MessageHeader header;
  FireSettings fire;
};
constexpr void fields(auto& visit, wire::Like<FireMessageV1> auto& m) {
  visit("header", m.header);
  visit("fire", m.fire);
}

struct FireMessageV2 {
  MessageHeader header;
  FireSettings fire;
  FireExtension extension;
};
constexpr void fields(auto& visit, wire::Like<FireMessageV2> auto& m) {
  visit("header", m.header);
  visit("fire", m.fire);
  visit("extension", m.extension);
}

struct StatusMessage {
  MessageHeader header;
  std::uint32_t device_id = 0;
  std::uint16_t device_type = 1;  // imaging sonar
  std::uint16_t part_number = 0;
  std::uint32_t status = 3;  // bits 0-2: 3 = main firmware runs
  std::uint32_t arm0_version = 0, arm0_date = 0, arm1_version = 0, arm1_date = 0, bitfile_version = 0, bitfile_date = 0;
  std::array<std::uint8_t, 4> ip_address{}, ip_mask{}, connected_ip{};  // octets in reading order
  std::array<std::uint8_t, 6> mac{};
  std::array<double, 8> temperature_c{};
  double pressure_bar = 0;
};
constexpr void fields(auto& visit, wire::Like<StatusMessage> auto& m) {
  visit("header", m.header);
  visit("deviceId", m.device_id, means::device_id);
  visit("deviceType", m.device_type);
  visit("partNumber", m.part_number, means::part_number);
  visit("status", m.status, means::device_status);
  visit("firmwareVersion0", m.arm0_version, means::firmware);
  visit("firmwareDate0", m.arm0_date, means::firmware);
  visit("firmwareVersion1", m.arm1_version, means::firmware);
  visit("firmwareDate1", m.arm1_date, means::firmware);
  visit("bitfileVersion", m.bitfile_version, means::firmware);
  visit("bitfileDate", m.bitfile_date, means::firmware);
  visit("ipAddr", m.ip_address, means::address);
  visit("ipMask", m.ip_mask, means::netmask);
  visit("connectedIpAddr", m.connected_ip, means::connected_address);
  visit("macAddr", m.mac, means::mac);
  visit("temperature", m.temperature_c, means::temperature);
  visit("pressure", m.pressure_bar, means::pressure);
}

/// The last fields of a ping result. Both versions have them; only the spare words between beams and offset differ.
struct ImageSizes {
  std::uint32_t image_offset = 0, image_size = 0, message_size = 0;
};
constexpr void fields(auto& visit, wire::Like<ImageSizes> auto& m) {
  visit("imageOffset", m.image_offset, means::image_offset);
  visit("imageSize", m.image_size, means::image_size);
  visit("messageSize", m.message_size, means::message_size);
}

/// The fixed part of a ping result. Bearings (i16 per beam, 0.01 deg, positive to starboard), filler and image follow.
struct PingResultV1 {
  MessageHeader header;
  FireSettings fire;
  std::uint32_t ping_id = 0, status = 0;
  double frequency_hz = 0, temperature_c = 0, pressure_bar = 0, sound_speed_mps = 0;
  std::uint32_t ping_start_time = 0;  // free-running counter, see option ping_start_time_unit
  DataSize data_size{};
  double range_resolution_m = 0;
  std::uint16_t row_count = 0, beam_count = 0;
  ImageSizes sizes;
};
constexpr void fields(auto& visit, wire::Like<PingResultV1> auto& m) {
  visit("header", m.header);
  visit("fire", m.fire);
  visit("pingId", m.ping_id, means::ping_id);
  visit("status", m.status, means::ping_status);
  visit("frequency", m.frequency_hz, means::frequency);
  visit("temperature", m.temperature_c, means::temperature);
  visit("pressure", m.pressure_bar, means::pressure);
  visit("speedOfSoundUsed", m.sound_speed_mps, means::sound_speed);
  visit("pingStartTime", m.ping_start_time, means::time);
  visit("dataSize", m.data_size, means::sample_type);
  visit("rangeResolution", m.range_resolution_m, means::range_resolution);
  visit("nRanges", m.row_count, means::rows);
  visit("nBeams", m.beam_count, means::beams);
  visit("sizes", m.sizes);
}

struct PingResultV2 {
  MessageHeader header;
  FireSettings fire;
  FireExtension extension;
  std::uint32_t ping_id = 0, status = 0;
  double frequency_hz = 0, temperature_c = 0, pressure_bar = 0;
  double heading_deg = 0, pitch_deg = 0, roll_deg = 0;
  double sound_speed_mps = 0;
  double ping_start_time_s = 0;  // time since power-up, with a resolution of a microsecond
  DataSize data_size{};
  double range_resolution_m = 0;
  std::uint16_t row_count = 0, beam_count = 0;
  std::array<std::uint32_t, 4> spare{};
  ImageSizes sizes;
};
constexpr void fields(auto& visit, wire::Like<PingResultV2> auto& m) {
  visit("header", m.header);
  visit("fire", m.fire);
  visit("extension", m.extension);
  visit("pingId", m.ping_id, means::ping_id);
  visit("status", m.status, means::ping_status);
  visit("frequency", m.frequency_hz, means::frequency);
  visit("temperature", m.temperature_c, means::temperature);
  visit("pressure", m.pressure_bar, means::pressure);
  visit("heading", m.heading_deg, means::heading);
  visit("pitch", m.pitch_deg, means::pitch);
  visit("roll", m.roll_deg, means::roll);
  visit("speedOfSoundUsed", m.sound_speed_mps, means::sound_speed);
  visit("pingStartTime", m.ping_start_time_s, means::time);
  visit("dataSize", m.data_size, means::sample_type);
  visit("rangeResolution", m.range_resolution_m, means::range_resolution);
  visit("nRanges", m.row_count, means::rows);
  visit("nBeams", m.beam_count, means::beams);
  visit("spare", m.spare);
  visit("sizes", m.sizes);
}

/// A client reads the stored values by sending address 0, and writes them by sending another address. Addresses are integers:
/// 192.168.1.2 is 0xC0A80102.
struct UserConfigMessage {
  MessageHeader header;
  std::uint32_t ip_address = 0, ip_mask = 0, dhcp_enable = 0;
};
constexpr void fields(auto& visit, wire::Like<UserConfigMessage> auto& m) {
  visit("header", m.header);
  visit("ipAddr", m.ip_address);
  visit("ipMask", m.ip_mask);
  visit("dhcpEnable", m.dhcp_enable);
}

/// Keep-alive, which has only a header.
struct DummyMessage {
  MessageHeader header;
};
constexpr void fields(auto& visit, wire::Like<DummyMessage> auto& m) { visit("header", m.header); }

static_assert(wire::wire_size<MessageHeader>() == 16);
static_assert(wire::wire_size<FireMessageV1>() == 53);
static_assert(wire::wire_size<FireMessageV2>() == 89);
static_assert(wire::wire_size<StatusMessage>() == 142);
static_assert(wire::wire_size<PingResultV1>() == 122);
static_assert(wire::wire_size<PingResultV2>() == 202);
static_assert(wire::wire_size<UserConfigMessage>() == 28);
static_assert(wire::wire_size<DummyMessage>() == 16);

inline constexpr std::size_t header_size = wire::wire_size<MessageHeader>();
inline constexpr std::size_t fire_v1_size = wire::wire_size<FireMessageV1>(), fire_v2_size = wire::wire_size<FireMessageV2>();
inline constexpr std::size_t status_size = wire::wire_size<StatusMessage>();
inline constexpr std::size_t user_config_size = wire::wire_size<UserConfigMessage>();
inline constexpr std::size_t ping_v1_size = wire::wire_size<PingResultV1>(), ping_v2_size = wire::wire_size<PingResultV2>();

}  // namespace sonar::oculus
