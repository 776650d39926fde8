#include "protocol/waterlinked/waterlinked.hpp"

#include "protocol/waterlinked/messages.hpp"

namespace sonar::waterlinked {
namespace {

using PortKind = protocol::Port::Kind;
// Port::gap is 0, so that the two images of a shot follow each other at once, because clients pair images that arrive within 25
// ms.
constexpr std::array<protocol::Port, 2> port_table{
    {{.kind = PortKind::http, .number = 80, .carries = "settings"},
     {.kind = PortKind::udp_stream, .carries = "range images", .group = multicast_group}}};

class WaterLinkedVendor final : public protocol::VendorWith<models, waterlinked::apply_override> {
 public:
  std::string_view name() const override { return "waterlinked"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override { return waterlinked::options(); }
  int default_max_clients() const override { return 1; }  // has no effect, because this sonar has no TCP streams

  protocol::ChangeSettings initial_settings(const protocol::DeviceState& device) const override {
    return change_to(waterlinked::initial_settings(device), device);
  }
  double gain_percent(const protocol::DeviceState&) const override { return 0; }  // the device sets its gain itself
  bool pings_before_first_request(const protocol::DeviceState&) const override { return true; }
  protocol::ResourceReply on_http(const protocol::Port&, const protocol::ResourceRequest& request,
                                  const protocol::DeviceState& device, Time now) const override {
    return answer(request, device, now);
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port&, const protocol::DeviceState&, Time) const override {
    return nullptr;
  }
  protocol::PingsBy pings_by() const override { return protocol::PingsBy::datagrams; }
  std::vector<protocol::Bytes> datagrams(const protocol::Port&, const Ping& ping,
                                         const protocol::DeviceState& device) const override {
    return encode_shot(ping, settings_from(ping.request.vendor_settings.get(), device), device);
  }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<WaterLinkedVendor>(); }

}  // namespace sonar::waterlinked
