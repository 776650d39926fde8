#include "protocol/dvl/dvl.hpp"

#include "protocol/dvl/dialogue.hpp"
#include "protocol/dvl/host.hpp"
#include "protocol/dvl/reports.hpp"
#include "protocol/dvl/sentences.hpp"

namespace sonar::dvl {
namespace {

constexpr auto processing_time = std::chrono::milliseconds(2);  // unknown: assumed; from the last echo to the report

using PortKind = protocol::Port::Kind;
constexpr std::array<protocol::Port, 2> port_table{
    {{.kind = PortKind::tcp_stream, .number = tcp_port}, {.kind = PortKind::tcp_stream, .number = serial_port}}};

class DvlVendor final : public protocol::PushingVendor {
 public:
  DvlVendor() : PushingVendor(tcp_port) {}
  std::string_view name() const override { return "dvl"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const std::shared_ptr<const SonarModel>> models() const override { return dvl::models(); }
  protocol::ChangeSettings initial_settings(const protocol::DeviceState& device) const override { return change_to({}, device); }
  Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted,
                                                  const protocol::DeviceState& device) const override {
    return dvl::apply_override(wanted, device);
  }
  double gain_percent(const protocol::DeviceState&) const override { return 0; }  // the device sets its gain itself
  std::optional<protocol::ChangeSettings> after_ping(const Ping& ping, const protocol::DeviceState& device) const override {
    const Measurement measured = measured_in(ping);
    Settings s = settings_from(device.settings.get());
    s.reckoning = reckoned(s.reckoning, measured, ping.request, s);
    // The search among range modes continues only after a ping of the present mode. A ping that was fired before a client changed
    // the mode does not show whether the new one fits.
    if (settings_from(ping.request.vendor_settings.get()).mode == s.mode)
      s.mode = next_mode(measured, s, product_of(*device.model));
    return change_to(s, device);
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port& port, const protocol::DeviceState& device,
                                               Time now) const override {
    return port.number == serial_port ? converse_in_sentences(device, now) : converse_in_json(device, now);
  }
  std::shared_ptr<const protocol::Bytes> frame(const Ping& ping, const protocol::DeviceState& device) const override {
    const Measurement measured = measured_in(ping);
    return std::make_shared<const protocol::Bytes>(velocity_line(measured, since_last(ping, device), sent_at(measured)));
  }
  std::vector<protocol::Bytes> datagrams(const protocol::Port& port, const Ping& ping,
                                         const protocol::DeviceState& device) const override {
    if (port.number != serial_port) return {};  // frame() is what it sends
    const Measurement measured = measured_in(ping);
    const SerialOutput output = settings_from(device.settings.get()).serial_output;
    Bytes lines = velocity_sentences(measured, since_last(ping, device), sent_at(measured), output);
    if (lines.empty()) return {};
    return {std::move(lines)};
  }

 private:
  /// A report states the time since the previous report; the first has 0.
  static std::chrono::nanoseconds since_last(const Ping& ping, const protocol::DeviceState& device) {
    const Time before = device.framed_at, fired = ping.request.fired_at;
    return before != Time{} && fired > before ? fired - before : std::chrono::nanoseconds(0);
  }
  static Time sent_at(const Measurement& measured) { return measured.heard_at + processing_time; }
};

}  // namespace

const protocol::Vendor& vendor() {
  static const DvlVendor only;
  return only;
}

}  // namespace sonar::dvl
