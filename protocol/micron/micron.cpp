#include "protocol/micron/micron.hpp"

#include <algorithm>

#include "protocol/micron/settings.hpp"

namespace sonar::micron {
namespace {

constexpr std::array<protocol::Port, 1> port_table{
    {{.kind = protocol::Port::Kind::tcp_stream, .number = tcp_port, .carries = "settings, scan lines"}}};

class MicronVendor final : public protocol::VendorWith<models, micron::apply_override, locate, locate> {
 public:
  std::string_view name() const override { return "micron"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override { return micron::options(); }
  int default_max_clients() const override { return 1; }  // a serial line has one host
  bool keeps_settings() const override { return true; }   // on a serial line the head cannot detect that a host has left
  protocol::ChangeSettings initial_settings(const protocol::DeviceState& device) const override { return change_to({}, device); }
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
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<MicronVendor>(); }

}  // namespace sonar::micron
