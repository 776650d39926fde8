#include "daemon/commands/replay/replay_device.hpp"

#include "daemon/server/time/clock.hpp"
#include "protocol/oculus/decode.hpp"
#include "protocol/oculus/oculus.hpp"

namespace sonar {
namespace {

constexpr std::uint64_t most_looked_at_bytes = 64u << 20;  // enough to find a status, which comes every second

/// Returns the reason if pings of that make cannot be served to a driver; empty if they can.
std::string why_only_seen(const protocol::Make& make) {
  if (make.codec.ping_part != nullptr) return "";
  if (make.each_ping_requested || make.scans) return "depend on the requests of the driver";
  return make.has_several_streams() ? "are sent over several connections" : "";
}

/// Describes a sonar of another make than Oculus.
void take(ReplayDevice& device, const recording::SentBy& by) {
  device.make = by.make;
  device.vendor = by.make->device;
  device.state = std::make_shared<protocol::DeviceState>();
  device.state->model = by.sender.model;
  if (device.http() != nullptr) {  // HTTP resources contain the id and the power-up time
    device.state->id = 1;
    device.state->powered_up_at = Clock::system_wall();
  }
  device.serial = by.sender.serial;
  if (const auto options = check_options(*device.vendor, {})) device.state->options = *options;
}

}  // namespace

std::string ReplayDevice::name() const {
  if (vendor != nullptr && serial == 0) return state->model->name;
  return "sonar " + std::to_string(vendor != nullptr ? serial : status.device_id);
}

std::uint16_t ReplayDevice::tcp_port() const {
  if (const protocol::Port* const port = http()) return port->number;
  return vendor != nullptr ? vendor->port(protocol::Port::Kind::tcp_stream)->number : oculus::tcp_port;
}
std::uint16_t ReplayDevice::status_port() const {
  if (vendor == nullptr) return oculus::status_port;
  const protocol::Port* const beacon = vendor->port(protocol::Port::Kind::udp_beacon);
  return beacon != nullptr ? beacon->number : 0;
}

protocol::Bytes ReplayDevice::status_at(Ipv4 ip, Ipv4 mask, Ipv4 client) const {
  if (vendor != nullptr) {
    state->connected_client = client;
    protocol::Bytes beacon = vendor->beacon(*state, {});
    vendor->change_integer(
        protocol::Part::beacon, protocol::FieldName::device_id, [this](auto) { return serial; }, beacon);
    return beacon;
  }
  oculus::StatusMessage here = status;
  here.ip_address = ip;
  here.ip_mask = mask;
  here.connected_ip = client;
  return wire::bytes_of(here);
}

/// Searches the first 64 MiB of the recording for the device id in the stream and for a status datagram.
Result<ReplayDevice> find_replay_device(recording::RecordingReader& reader, const std::string& file, std::uint16_t part_number) {
  ReplayDevice device;
  std::optional<std::uint16_t> id;
  std::uint64_t looked_at = 0;
  const protocol::Make* unserved = nullptr;
  while (auto message = reader.next()) {
    looked_at += message->bytes.size();
    if (looked_at > most_looked_at_bytes || (id && device.recorded_status)) break;
    if (message->from != recording::Origin::device) continue;
    const auto by = recording::sender_of(*message);
    if (by && !why_only_seen(*by->make).empty()) {
      unserved = by->make;
      break;
    }
    if (by && by->make->device != &oculus::vendor()) {
      take(device, *by);
      break;
    }
    if (message->bytes.size() < oculus::header_size) continue;
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
  if (device.by_requests())
    if (const auto named = recording::find_sender(reader)) device.state->model = named->sender.model;
  if (device.vendor != nullptr) return device;
  if (unserved != nullptr) {
    device.is_only_seen = file + " holds pings of " + std::string(unserved->title) +
                          ". They cannot be replayed to a driver, because they " + why_only_seen(*unserved) +
                          "; the page (--http IP:PORT) shows them";
    return device;
  }
  if (!id)
    return failure(ErrorKind::bad_data, file + " holds no message of a sonar" + (damage ? ": " + damage->text : std::string()));
  // Without a recorded status, the values that drivers check are made up: id, part number and hardware address.
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
