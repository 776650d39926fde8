#include "protocol/oculus/oculus.hpp"

#include "protocol/oculus/encode_ping.hpp"
#include "protocol/oculus/models.hpp"
#include "protocol/oculus/settings.hpp"

namespace sonar::oculus {
namespace {

using namespace std::chrono_literals;

using PortKind = protocol::Port::Kind;
// The status is sent once per second, because without it the public viewer gives up after 2 s, another driver after 5 s.
constexpr std::array<protocol::Port, 2> port_table{
    {{.kind = PortKind::tcp_stream, .number = tcp_port, .carries = "settings, pings"},
     {.kind = PortKind::udp_beacon, .number = status_port, .carries = "address, state", .period = 1000ms}}};

class OculusVendor final : public protocol::VendorWith<models, oculus::apply_override, nullptr, locate> {
 public:
  std::string_view name() const override { return "oculus"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override { return oculus::options(); }
  int default_max_clients() const override { return 1; }  // the status message has room for one client's address
  Result<std::shared_ptr<const SonarModel>> tuned(std::shared_ptr<const SonarModel> model,
                                                  const protocol::OptionValues& options) const override {
    return oculus::tuned(std::move(model), options);
  }

  protocol::ChangeSettings initial_settings(const protocol::DeviceState& device) const override {
    const FireRequest fire = stored_fire();
    return {resolve(fire, device).settings, std::make_shared<HeldFire>(fire), "stored configuration: " + describe(fire)};
  }
  double gain_percent(const protocol::DeviceState& device) const override {
    return fire_of(device.settings.get()).settings.gain_percent;
  }
  bool pings_before_first_request(const protocol::DeviceState& device) const override {
    return text_option(device.options, option_name::before_first_fire) == "pings";
  }
  protocol::Bytes beacon(const protocol::DeviceState& device, Time) const override { return make_status(device); }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port&, const protocol::DeviceState& device,
                                               Time now) const override {
    return make_dialogue(device, now);
  }
  std::shared_ptr<const protocol::Bytes> frame(const Ping& ping, const protocol::DeviceState& device) const override {
    return std::make_shared<const protocol::Bytes>(encode_ping(ping, device, fire_of(ping.request.vendor_settings.get())));
  }
  std::optional<protocol::Field> field(protocol::Part part, protocol::FieldName name,
                                       protocol::BytesView message) const override {
    return locate(part, name, message);
  }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<OculusVendor>(); }

}  // namespace sonar::oculus
