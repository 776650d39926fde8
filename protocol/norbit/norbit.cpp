#include "protocol/norbit/norbit.hpp"

#include "protocol/norbit/settings.hpp"

namespace sonar::norbit {
namespace {

using PortKind = protocol::Port::Kind;
constexpr std::array<protocol::Port, 3> port_table{
    {{.kind = PortKind::tcp_stream, .number = bathymetry_port, .carries = "points"},
     {.kind = PortKind::tcp_stream, .number = column_port, .carries = "water column"},
     {.kind = PortKind::tcp_stream, .number = command_port, .carries = "commands", .has_pings = false}}};

class NorbitVendor final : public protocol::VendorWith<models, norbit::apply_override, locate, locate> {
 public:
  std::string_view name() const override { return "norbit"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  int default_max_clients() const override { return 12; }  // four drivers that each use all three ports
  protocol::ChangeSettings initial_settings(const protocol::DeviceState& device) const override { return change_to({}, device); }
  double gain_percent(const protocol::DeviceState& device) const override {
    return norbit::gain_percent(settings_from(device.settings.get()));
  }
  bool keeps_settings() const override { return true; }  // DFD: set_default restores the startup defaults
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port& port, const protocol::DeviceState& device,
                                               Time now) const override {
    return make_dialogue(port, device, now);
  }
  std::vector<Bytes> datagrams(const protocol::Port& port, const Ping& ping, const protocol::DeviceState& device) const override {
    if (port.number == bathymetry_port) return {encode_bathymetry(ping, device)};
    if (port.number == column_port) return {encode_column(ping, device)};
    return {};
  }
  void reseal(BytesView before, Bytes& ping) const override { norbit::reseal(before, ping); }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<NorbitVendor>(); }

}  // namespace sonar::norbit
