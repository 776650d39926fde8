#include "protocol/aris/aris.hpp"

#include "protocol/aris/encode_frame.hpp"
#include "protocol/aris/models.hpp"
#include "protocol/aris/settings.hpp"

namespace sonar::aris {
namespace {

using namespace std::chrono_literals;

using PortKind = protocol::Port::Kind;
// unknown: the gap between the parts of a frame. With 20 us a receive buffer of 64 kB does not overflow.
constexpr std::array<protocol::Port, 3> port_table{
    {{.kind = PortKind::tcp_stream, .number = command_port, .carries = "settings; frames come by UDP"},
     {.kind = PortKind::udp_beacon, .number = beacon_port, .carries = "address, state", .period = 1000ms, .on_change = true},
     {.kind = PortKind::udp_stream, .any_group = true, .gap = 20us}}};

class ArisVendor final : public protocol::VendorWith<models, aris::apply_override, locate, locate> {
 public:
  std::string_view name() const override { return "aris"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override { return aris::options(); }
  int default_max_clients() const override { return 1; }  // one controller is connected at a time

  protocol::ChangeSettings initial_settings(const protocol::DeviceState& device) const override {
    return change_to(aris::initial_settings(device), device);
  }
  double gain_percent(const protocol::DeviceState& device) const override {
    return 100 / highest_gain_db * static_cast<double>(settings_from(device.settings.get(), device).acoustics.gain_db);
  }
  protocol::PingsBy pings_by() const override { return protocol::PingsBy::datagrams; }
  protocol::Bytes beacon(const protocol::DeviceState& device, Time) const override { return make_beacon(device); }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port&, const protocol::DeviceState& device, Time) const override {
    return make_dialogue(device);
  }
  std::vector<protocol::Bytes> datagrams(const protocol::Port&, const Ping& ping,
                                         const protocol::DeviceState& device) const override {
    return encode_frame(ping, device, settings_from(ping.request.vendor_settings.get(), device));
  }
  bool change_integer(protocol::Part part, protocol::FieldName name, const std::function<std::int64_t(std::int64_t)>& change,
                      protocol::Bytes& message) const override {
    return part == protocol::Part::ping ? change_part(name, change, message) : change_beacon(name, change, message);
  }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<ArisVendor>(); }

}  // namespace sonar::aris
