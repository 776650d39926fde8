#include "protocol/norbit/norbit.hpp"

#include "protocol/norbit/settings.hpp"

namespace sonar::norbit {
namespace {

using PortKind = protocol::Port::Kind;
constexpr std::array<protocol::Port, 3> port_table{
    {{.kind = PortKind::tcp_stream, .number = bathymetry_port, .carries = "points"},
     {.kind = PortKind::tcp_stream, .number = column_port, .carries = "water column"},
     {.kind = PortKind::tcp_stream, .number = command_port, .carries = "commands", .has_pings = false}}};

class NorbitVendor final : public protocol::Vendor {
 public:
  std::string_view name() const override { return "norbit"; }
  std::span<const std::shared_ptr<const SonarModel>> models() const override { return norbit::models(); }
  std::span<const protocol::Port> ports() const override { return port_table; }
  int default_max_clients() const override { return 12; }  // four drivers that each use all three ports
  protocol::ChangeSettings initial_settings(const protocol::DeviceState& device) const override { return change_to({}, device); }
  Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted,
                                                  const protocol::DeviceState& device) const override {
    return norbit::apply_override(wanted, device);
  }
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
  std::optional<protocol::Field> field(protocol::Part part, protocol::FieldName name, BytesView message) const override {
    return part == protocol::Part::ping ? locate(name, message) : std::nullopt;
  }
  std::optional<std::pair<std::size_t, std::size_t>> region(protocol::Region region, BytesView ping) const override {
    return locate(region, ping);
  }
  void reseal(BytesView before, Bytes& ping) const override { norbit::reseal(before, ping); }
};

}  // namespace

const protocol::Vendor& vendor() {
  static const NorbitVendor only;
  return only;
}

}  // namespace sonar::norbit
