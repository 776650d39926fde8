#include "protocol/oculus/replies.hpp"

#include <algorithm>

#include "core/sonar/water.hpp"
#include "core/text/ipv4.hpp"
#include "protocol/oculus/settings.hpp"

namespace sonar::oculus {
namespace {

constexpr std::uint32_t main_firmware_runs = 3, main_connection = 1u << 7;  // APL aborts if bits 0 to 2 are 0 or 1
// unknown: versions of the real firmware; major 8 bits, minor 8, build 16. Assumed: 1.0 build 0.
constexpr std::uint32_t firmware_version = 0x01000000, firmware_date = 0;
// unknown: dstDeviceId of the status, 0xFFFF in the notes of ALD on a real M750d; assumed: 0, as in CAP's pings. No driver reads
// it.

MessageHeader header_for(MessageType type, std::uint16_t device_id, std::size_t message_size) {
  MessageHeader header;
  header.source = device_id;
  header.type = type;
  header.payload_size = static_cast<std::uint32_t>(message_size - header_size);
  return header;
}

}  // namespace

wire::Bytes make_status(const protocol::DeviceState& device) {
  StatusMessage status;
  status.header = header_for(MessageType::status, device.id, status_size);
  status.header.part_number = status.part_number = device.model->part_number;
  status.device_id = device.id;
  status.status = main_firmware_runs;
  if (text_option(device.options, option_name::status_bit7) == "set") status.status |= main_connection;
  status.arm0_version = status.arm1_version = status.bitfile_version = firmware_version;
  status.arm0_date = status.arm1_date = status.bitfile_date = firmware_date;
  status.ip_address = device.advertise_ip;
  status.ip_mask = device.netmask;
  status.connected_ip = device.connected_client;
  status.mac = device.mac;
  // All eight sensors read the temperature of the water. A warmer electronics would be realistic, but ENS commands standby at 35
  // degrees.
  status.temperature_c.fill(device.water.temperature_c);
  status.pressure_bar = absolute_pressure_bar(device.water, device.depth_m);
  return wire::bytes_of(status);
}

wire::Bytes make_dummy(std::uint16_t device_id) {
  return wire::bytes_of(DummyMessage{header_for(MessageType::dummy, device_id, header_size)});
}

wire::Bytes make_user_config(std::uint16_t device_id, const protocol::StoredAddress& stored,
                             const protocol::DeviceState& device) {
  UserConfigMessage config;
  config.header = header_for(MessageType::user_config, device_id, user_config_size);
  // The first octet is the most significant byte here, the reverse of the status message.
  config.ip_address = stored.ip != 0 ? stored.ip : text::number_from_ipv4(device.advertise_ip);
  config.ip_mask = stored.ip != 0 ? stored.netmask : text::number_from_ipv4(device.netmask);
  config.dhcp_enable = stored.dhcp ? 1 : 0;
  return wire::bytes_of(config);
}

wire::Bytes make_log(std::uint16_t device_id, std::string_view text) {
  wire::Bytes out = wire::bytes_of(header_for(MessageType::log, device_id, header_size + text.size()));
  std::transform(text.begin(), text.end(), std::back_inserter(out), [](char c) { return static_cast<std::byte>(c); });
  return out;
}

}  // namespace sonar::oculus
