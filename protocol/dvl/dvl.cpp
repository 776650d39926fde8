#include "protocol/dvl/dvl.hpp"

#include "protocol/dvl/dialogue.hpp"
#include "protocol/dvl/host.hpp"
#include "protocol/dvl/reports.hpp"

namespace sonar::dvl {
namespace {

constexpr auto processing_time = std::chrono::milliseconds(2);  // unknown: assumed; from the last echo to the report

class DvlVendor final : public protocol::PushingVendor {
 public:
  DvlVendor() : PushingVendor(tcp_port) {}
  std::string_view name() const override { return "dvl"; }
  std::span<const std::shared_ptr<const SonarModel>> models() const override { return dvl::models(); }
  protocol::ChangeSettings initial_settings(const protocol::DeviceState& device) const override { return change_to({}, device); }
  Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted,
                                                  const protocol::DeviceState& device) const override {
    return dvl::apply_override(wanted, device);
  }
  double gain_percent(const protocol::DeviceState&) const override { return 0; }  // the device sets its gain itself
  std::optional<protocol::ChangeSettings> after_ping(const Ping& ping, const protocol::DeviceState& device) const override {
    const Measurement measured = measure(ping);
    Settings s = settings_from(device.settings.get());
    s.reckoning = reckoned(s.reckoning, measured, ping.request, s);
    // The search among range modes goes on only after a ping of the present mode. A ping that was fired before a client changed
    // the mode does not tell whether the new one fits.
    if (settings_from(ping.request.vendor_settings.get()).mode == s.mode)
      s.mode = next_mode(measured, s, product_of(*device.model));
    return change_to(s, device);
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port&, const protocol::DeviceState& device,
                                               Time now) const override {
    return make_dialogue(device, now);
  }
  std::shared_ptr<const protocol::Bytes> frame(const Ping& ping, const protocol::DeviceState& device) const override {
    const Measurement measured = measure(ping);
    // "time" of a report is the time since the previous report; the first has 0.
    const Time before = device.framed_at, fired = ping.request.fired_at;
    const auto since = before != Time{} && fired > before ? fired - before : std::chrono::nanoseconds(0);
    return std::make_shared<const protocol::Bytes>(velocity_line(measured, since, measured.heard_at + processing_time));
  }
};

}  // namespace

const protocol::Vendor& vendor() {
  static const DvlVendor only;
  return only;
}

}  // namespace sonar::dvl
