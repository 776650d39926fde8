#include "daemon/commands/replay/replay_device.hpp"

#include "protocol/oculus/decode.hpp"

namespace sonar {
namespace {

constexpr std::uint64_t most_looked_at_bytes = 64u << 20;  // a status comes every second

}  // namespace

protocol::Bytes ReplayDevice::status_at(Ipv4 ip, Ipv4 mask, Ipv4 client) const {
  oculus::StatusMessage here = status;
  here.ip_address = ip;
  here.ip_mask = mask;
  here.connected_ip = client;
  return wire::bytes_of(here);
}

Result<ReplayDevice> find_replay_device(recording::RecordingReader& reader, const std::string& file, std::uint16_t part_number) {
  ReplayDevice device;
  std::optional<std::uint16_t> id;
  std::uint64_t looked_at = 0;
  while (auto message = reader.next()) {
    looked_at += message->bytes.size();
    if (looked_at > most_looked_at_bytes || (id && device.recorded_status)) break;
    if (message->from != recording::Origin::device || message->bytes.size() < oculus::header_size) continue;
    const oculus::MessageHeader header = oculus::header_of(message->bytes);
    if (header.oculus_id != oculus::magic) continue;
    if (message->by == recording::Carrier::stream) {
      if (!id) id = header.source;
    } else if (const auto status = oculus::decode_status(message->bytes); status && !device.recorded_status) {
      device.status = *status;
      device.recorded_status = true;
    }
  }
  const auto damage = reader.damage();
  reader.rewind();
  if (!id)
    return failure(ErrorKind::bad_data, file + " holds no message of a sonar" + (damage ? ": " + damage->text : std::string()));
  if (!device.recorded_status) {
    device.status.device_id = *id;
    device.status.part_number = device.status.header.part_number = part_number;
    device.status.mac = {0x02, 0x53, 0x4F, 0, static_cast<std::uint8_t>(*id >> 8), static_cast<std::uint8_t>(*id & 0xFF)};
    device.status.temperature_c.fill(20);
    device.status.pressure_bar = 1.013;
  }
  device.status.header.type = oculus::MessageType::status;
  device.status.header.source = *id;
  device.status.header.payload_size = static_cast<std::uint32_t>(oculus::status_size - oculus::header_size);
  return device;
}

}  // namespace sonar
