#include <algorithm>
#include <array>
#include <cstdio>

#include "core/text/ipv4.hpp"
#include "protocol/ping/locate.hpp"
#include "protocol/ping/ping360_settings.hpp"
#include "protocol/ping/products.hpp"

namespace sonar::ping::ping360 {
namespace {

using PortKind = protocol::Port::Kind;
constexpr std::uint16_t data_port = 12345, discovery_port = 30303;
constexpr std::array<protocol::Port, 2> port_table{
    {{.kind = PortKind::udp_dialogue, .number = data_port, .carries = "settings, scan lines"},
     {.kind = PortKind::udp_answer, .number = discovery_port, .carries = "discovery"}}};

std::string text_of(protocol::BytesView bytes) {
  std::string text;
  for (const std::byte b : bytes) text += static_cast<char>(std::to_integer<unsigned char>(b));
  return text;
}

/// The answer to "Discovery": four lines, each ended by CR LF, in one datagram to the host that asked. The numbers of the address
/// have three digits.
protocol::Bytes discovery_answer(const protocol::DeviceState& device) {
  const auto& m = device.mac;
  const auto& ip = device.advertise_ip;
  char text[160];
  const int size = std::snprintf(
      text, sizeof text,
      "PING360\r\nBlue Robotics\r\nMAC Address:- %02X-%02X-%02X-%02X-%02X-%02X\r\nIP Address:- %03d.%03d.%03d.%03d\r\n", m[0],
      m[1], m[2], m[3], m[4], m[5], ip[0], ip[1], ip[2], ip[3]);
  protocol::Bytes bytes;
  for (int i = 0; i < size; ++i) bytes.push_back(static_cast<std::byte>(text[i]));
  return bytes;
}

/// The address in "SetSS1IP 192.168.002.010". An address of zeros selects DHCP.
std::optional<protocol::StoredAddress> address_in(const std::string& text) {
  unsigned a = 0, b = 0, c = 0, d = 0;
  if (std::sscanf(text.c_str(), "SetSS1IP %3u.%3u.%3u.%3u", &a, &b, &c, &d) != 4 || std::max({a, b, c, d}) > 255) return {};
  const protocol::Ipv4 ip{static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b), static_cast<std::uint8_t>(c),
                          static_cast<std::uint8_t>(d)};
  return protocol::StoredAddress{.ip = text::number_from_ipv4(ip), .netmask = 0, .dhcp = ip == protocol::Ipv4{}};
}

class Ping360Vendor final : public protocol::Vendor {
 public:
  std::string_view name() const override { return "ping360"; }
  std::span<const std::shared_ptr<const SonarModel>> models() const override { return ping360::models(); }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override { return ping360::options(); }
  int default_max_clients() const override { return 1; }  // the host that sent last
  protocol::ChangeSettings initial_settings(const protocol::DeviceState& device) const override {
    return change_to(Settings{}, device);
  }
  Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted,
                                                  const protocol::DeviceState& device) const override {
    return ping360::apply_override(wanted, device);
  }
  double gain_percent(const protocol::DeviceState& device) const override {
    return 50.0 * settings_from(device.settings.get()).ping.gain;
  }
  protocol::PingsBy pings_by() const override { return protocol::PingsBy::datagrams; }
  /// Scans the half circle ahead to and fro, with a range of 10 m unless a host or the configuration has set another.
  std::optional<ScanStep> scan_step(std::uint32_t number, const protocol::DeviceState& device) const override {
    Settings s = settings_from(device.settings.get());
    if (HeldSettings(s).equals(HeldSettings(Settings{})))
      if (const auto usual =
              ping360::apply_override({.range_m = 10, .rate_hz = {}, .gain_percent = {}, .mode = {}, .beams = {}}, device))
        s = settings_from(usual->vendor_settings.get());
    constexpr std::uint32_t half = grads / 2;
    const std::uint32_t place = (number - 1) % grads;
    s.ping.angle = static_cast<std::uint16_t>((grads - half / 2 + std::min(place, grads - place)) % grads);
    s.ping.transmit = 1;
    return ScanStep{{.head_rad = head_rad(s.ping.angle, device.options), .with = std::make_shared<HeldSettings>(s)},
                    ping_settings(s, device)};
  }
  bool is_request(const protocol::Port&, protocol::BytesView datagram) const override { return holds_frame(datagram); }
  /// The discovery port has a text protocol of its own. SetSS1IP changes the address of a real device; here it is stored only.
  protocol::Reaction on_datagram(const protocol::Port&, protocol::BytesView datagram, const protocol::DeviceState& device,
                                 Time) const override {
    protocol::Reaction reaction;
    const std::string text = text_of(datagram);
    if (text.starts_with("Discovery")) reaction.replies.push_back(discovery_answer(device));
    if (const auto address = address_in(text)) reaction.events.emplace_back(protocol::StoreAddress{*address});
    return reaction;
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port& port, const protocol::DeviceState& device,
                                               Time now) const override {
    return make_dialogue(device, port, now);
  }
  std::vector<protocol::Bytes> datagrams(const protocol::Port&, const Ping& ping, const protocol::DeviceState&) const override {
    return {encode(settings_from(ping.request.vendor_settings.get()), ping.samples)};
  }
  std::optional<protocol::Field> field(protocol::Part part, protocol::FieldName name,
                                       protocol::BytesView message) const override {
    return part == protocol::Part::ping ? locate_ping360(name, message) : std::nullopt;
  }
  void reseal(protocol::BytesView before, protocol::Bytes& ping) const override { sonar::ping::reseal(before, ping); }
  std::optional<std::pair<std::size_t, std::size_t>> region(protocol::Region region, protocol::BytesView ping) const override {
    return locate_ping360(region, ping);
  }
};

}  // namespace

const protocol::Vendor& vendor() {
  static const Ping360Vendor only;
  return only;
}

}  // namespace sonar::ping::ping360
