#include "protocol/micron/micron.hpp"

#include <algorithm>

#include "protocol/micron/settings.hpp"

namespace sonar::micron {
namespace {

constexpr std::array<protocol::Port, 1> port_table{
    {{.kind = protocol::Port::Kind::tcp_stream, .number = tcp_port, .carries = "settings, scan lines"}}};

class MicronVendor final : public protocol::Vendor {
 public:
  std::string_view name() const override { return "micron"; }
  std::span<const std::shared_ptr<const SonarModel>> models() const override { return micron::models(); }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override { return micron::options(); }
  int default_max_clients() const override { return 1; }  // a serial line has one host
  bool keeps_settings() const override { return true; }   // on a serial line the head cannot detect that a host has left
  protocol::ChangeSettings initial_settings(const protocol::DeviceState& device) const override { return change_to({}, device); }
  Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted,
                                                  const protocol::DeviceState& device) const override {
    return micron::apply_override(wanted, device);
  }
  double gain_percent(const protocol::DeviceState& device) const override {
    return 100.0 * settings_from(device.settings.get()).command.gain / most_gain;
  }
  /// Scans the half circle ahead, back and forth, in steps of a grad.
  std::optional<ScanStep> scan_step(std::uint32_t number, const protocol::DeviceState& device) const override {
    constexpr std::uint32_t steps = 200;
    Settings s = settings_from(device.settings.get());
    const std::uint32_t place = (number - 1) % (2 * steps);
    s.command.step = 16;
    s.bearing = static_cast<std::uint16_t>(ahead - turn / 4 + 16 * std::min(place, 2 * steps - place));
    return ScanStep{{.head_rad = head_rad(s), .with = std::make_shared<HeldSettings>(s)}, ping_settings(s, device)};
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port&, const protocol::DeviceState& device,
                                               Time now) const override {
    return make_dialogue(device, now);
  }
  std::shared_ptr<const protocol::Bytes> frame(const Ping& ping, const protocol::DeviceState& device) const override {
    return std::make_shared<const protocol::Bytes>(encode(ping, device));
  }
  std::optional<protocol::Field> field(protocol::Part part, protocol::FieldName name,
                                       protocol::BytesView message) const override {
    return part == protocol::Part::ping ? locate(name, message) : std::nullopt;
  }
  std::optional<std::pair<std::size_t, std::size_t>> region(protocol::Region region, protocol::BytesView ping) const override {
    return locate(region, ping);
  }
};

}  // namespace

const protocol::Vendor& vendor() {
  static const MicronVendor only;
  return only;
}

}  // namespace sonar::micron
