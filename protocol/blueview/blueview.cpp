#include "protocol/blueview/blueview.hpp"

#include "protocol/blueview/encode_ping.hpp"
#include "protocol/blueview/head_settings.hpp"
#include "protocol/blueview/models.hpp"

namespace sonar::blueview {
namespace {

using PortKind = protocol::Port::Kind;
// The drop-in libraries find sonars with a broadcast, so there is no beacon.
constexpr std::array<protocol::Port, 2> port_table{
    {{.kind = PortKind::tcp_stream, .number = tcp_port, .carries = "settings, pings"},
     {.kind = PortKind::udp_answer, .number = discovery_port, .carries = "discovery"}}};

class BlueViewVendor final : public protocol::VendorWith<models, blueview::apply_override, locate, locate> {
 public:
  std::string_view name() const override { return "blueview"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override { return blueview::options(); }
  int default_max_clients() const override { return 8; }

  protocol::ChangeSettings initial_settings(const protocol::DeviceState& device) const override {
    const SonarSettings settings = initial_sonar_settings(device);
    return {ping_settings(settings, device), std::make_shared<SonarSettings>(settings),
            "initial settings: " + describe(settings, device)};
  }
  double gain_percent(const protocol::DeviceState& device) const override {
    const SonarSettings settings = settings_from(device.settings.get(), device);
    return gain_percent_from(static_cast<double>(settings.heads[static_cast<std::size_t>(settings.active_head)].gain_db));
  }
  protocol::Reaction on_datagram(const protocol::Port&, protocol::BytesView datagram, const protocol::DeviceState& device,
                                 Time) const override {
    protocol::Reaction reaction;
    if (protocol::Bytes reply = answer_discovery(datagram, device); !reply.empty()) reaction.replies.push_back(std::move(reply));
    return reaction;
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port&, const protocol::DeviceState& device,
                                               Time now) const override {
    return make_dialogue(device, now);
  }
  std::shared_ptr<const protocol::Bytes> frame(const Ping& ping, const protocol::DeviceState& device) const override {
    const SonarSettings settings = settings_from(ping.request.vendor_settings.get(), device);
    return std::make_shared<const protocol::Bytes>(encode_ping(ping, device, settings));
  }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<BlueViewVendor>(); }

}  // namespace sonar::blueview
