#include "daemon/commands/replay/replay_device.hpp"

#include "daemon/server/time/clock.hpp"
#include "protocol/aris/aris.hpp"
#include "protocol/aris/encode_frame.hpp"
#include "protocol/aris/models.hpp"
#include "protocol/oculus/decode.hpp"
#include "protocol/ping/messages.hpp"
#include "protocol/ping/omniscan.hpp"
#include "protocol/ping/surveyor.hpp"
#include "protocol/waterlinked/rip.hpp"
#include "protocol/waterlinked/waterlinked.hpp"

namespace sonar {
namespace {

constexpr std::uint64_t most_looked_at_bytes = 64u << 20;  // a status comes every second

void take(ReplayDevice& device, const protocol::Vendor& vendor, std::shared_ptr<const SonarModel> model) {
  device.vendor = &vendor;
  device.state = std::make_shared<protocol::DeviceState>();
  device.state->model = std::move(model);
  if (const auto options = check_options(vendor, {})) device.state->options = *options;
}

/// The ARIS that sent this datagram; none: it is not the first of a frame, or of no known product.
void take_aris(ReplayDevice& device, const protocol::Bytes& datagram) {
  aris::FramePart part;
  if (!aris::protobuf::read(datagram, part) || !part.header || part.header->size() < aris::header_size) return;
  aris::FrameHeader header;
  wire::Reader reader(*part.header);
  fields(reader, header);
  for (const auto& model : aris::vendor().models()) {
    if (static_cast<std::uint32_t>(aris::product_of(*model).system) != header.system) continue;
    device.serial = header.serial;
    return take(device, aris::vendor(), model);
  }
}

std::optional<ping::Header> ping_header(const protocol::Bytes& message) {
  ping::Header header;
  wire::Reader reader(message);
  fields(reader, header);
  return reader.ok() && header.start == ping::Header{}.start ? std::optional(header) : std::nullopt;
}

/// The sonar of the ping protocol that sends such frames; none: several kinds do.
void take_ping(ReplayDevice& device, const protocol::Bytes& message) {
  const auto found = ping_header(message);
  if (!found) return;
  const ping::Header& header = *found;
  if (header.id == ping::Id::atof_point_data || header.id == ping::Id::yz_point_data)
    take(device, ping::surveyor::vendor(), ping::surveyor::vendor().models().front());
  if (header.id == ping::Id::os_mono_profile) take(device, ping::omniscan::vendor(), ping::omniscan::vendor().models().front());
}

/// A Sonar 3D-15, whose packets do not tell which.
void take_3d15(ReplayDevice& device, const protocol::Bytes& datagram) {
  if (waterlinked::rip_length(datagram) != datagram.size()) return;
  take(device, waterlinked::vendor(), waterlinked::vendor().models().front());
  device.state->id = 1;
  device.state->powered_up_at = Clock::system_wall();
}

/// By what a device sent; none: another packet may tell.
void take_sender(ReplayDevice& device, const recording::RecordedMessage& message) {
  if (message.by == recording::Carrier::stream) return take_ping(device, message.bytes);
  take_3d15(device, message.bytes);
  if (device.vendor == nullptr) take_aris(device, message.bytes);
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

Result<ReplayDevice> find_replay_device(recording::RecordingReader& reader, const std::string& file, std::uint16_t part_number) {
  ReplayDevice device;
  std::optional<std::uint16_t> id;
  std::uint64_t looked_at = 0;
  bool speaks_ping = false;  // as a Ping360 does
  while (auto message = reader.next()) {
    looked_at += message->bytes.size();
    if (looked_at > most_looked_at_bytes || (id && device.recorded_status)) break;
    if (message->from != recording::Origin::device) continue;
    take_sender(device, *message);
    if (device.vendor != nullptr) break;
    speaks_ping = speaks_ping || ping_header(message->bytes).has_value();
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
  if (device.vendor != nullptr) return device;
  if (!id && speaks_ping)
    return failure(ErrorKind::bad_data,
                   file +
                       " holds messages of the ping protocol, but no points and no profile: pings of a Surveyor "
                       "or an Omniscan can be replayed, those of a Ping360 cannot");
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
