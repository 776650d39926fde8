#include "protocol/ping/locate.hpp"
#include "protocol/ping/ping1d_settings.hpp"
#include "protocol/ping/products.hpp"
#include "protocol/ping/streaming.hpp"

namespace sonar::ping::ping1d {
namespace {

// The port of the bridge by which vehicles serve the serial line.
constexpr auto port_table = streaming_ports(9090, "settings, distances, profiles");

class Ping1DVendor final : public StreamingVendor {
 public:
  std::string_view name() const override { return "ping1d"; }
  std::span<const std::shared_ptr<const SonarModel>> models() const override { return ping1d::models(); }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override {
    static const std::array<protocol::Option, 2> all{
        {type_option("1", "number of the product in its device information"), silence_option()}};
    return all;
  }
  protocol::ChangeSettings initial_settings(const protocol::DeviceState&) const override { return change_to(Settings{}); }
  Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted,
                                                  const protocol::DeviceState& device) const override {
    return ping1d::apply_override(wanted, device);
  }
  double gain_percent(const protocol::DeviceState& device) const override {
    return 100.0 / 6 * settings_from(device.settings.get()).parameters.gain;
  }
  std::optional<protocol::ChangeSettings> after_ping(const Ping& ping, const protocol::DeviceState& device) const override {
    Settings s = settings_from(device.settings.get());
    if (s.parameters.mode_auto == 0) return std::nullopt;
    const Parameters before = settings_from(ping.request.vendor_settings.get()).parameters;
    if (before.range.start_mm != s.parameters.range.start_mm || before.range.length_mm != s.parameters.range.length_mm ||
        before.gain != s.parameters.gain)
      return std::nullopt;  // a host has changed range or gain since: the ping does not show whether the new ones fit
    const Parameters next = adjusted(s.parameters, echo_in(ping));
    if (next == s.parameters) return std::nullopt;
    s.parameters = next;
    return change_to(s);
  }
  bool measures_distance() const override { return true; }
  std::optional<protocol::Distance> distance_in(const Ping& ping) const override {
    const Echo echo = echo_in(ping);
    return protocol::Distance{echo.range_m, echo.confidence};
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port& port, const protocol::DeviceState& device,
                                               Time now) const override {
    return make_dialogue(device, port, now);
  }
  std::optional<protocol::Field> field(protocol::Part part, protocol::FieldName name,
                                       protocol::BytesView message) const override {
    return part == protocol::Part::ping ? locate_ping1d(name, message) : std::nullopt;
  }
  std::optional<std::pair<std::size_t, std::size_t>> region(protocol::Region region, protocol::BytesView ping) const override {
    return locate_ping1d(region, ping);
  }

 protected:
  std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState&) const override { return ping1d::frames_of(ping); }
};

}  // namespace

const protocol::Vendor& vendor() {
  static const Ping1DVendor only;
  return only;
}

}  // namespace sonar::ping::ping1d
