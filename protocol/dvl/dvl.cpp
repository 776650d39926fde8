#include "protocol/dvl/dvl.hpp"

#include "protocol/dvl/reports.hpp"

namespace sonar::dvl {
namespace {

/// Delay from the last echo to the report. Three public reports, from software of different years, have 88 ms and 147 ms (USR)
/// and 189 ms (DOC), which is too little evidence for a default.
constexpr std::string_view report_delay = "report_delay_ms";
constexpr double assumed_delay_ms = 2;  // in the reports, if the option is not set

std::optional<double> wanted_delay_ms(const protocol::DeviceState& device) {
  return protocol::given_number(device.options, report_delay);
}

using PortKind = protocol::Port::Kind;
constexpr std::array<protocol::Port, 2> port_table{
    {{.kind = PortKind::tcp_stream, .number = tcp_port, .carries = "settings, reports in JSON"},
     {.kind = PortKind::tcp_stream, .number = serial_port, .carries = "settings, serial sentences"}}};

class DvlVendor final : public protocol::VendorWith<models, dvl::apply_override, nullptr, nullptr, protocol::PushingVendor> {
 public:
  DvlVendor() : VendorWith(tcp_port) {}
  std::string_view name() const override { return "dvl"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override {
    static const std::array<protocol::Option, 1> all{
        {{report_delay,
          {},
          "none",
          "milliseconds from a ping's last echo to its report; none: it is sent as soon as it is made",
          0,
          1000}}};
    return all;
  }
  bool keeps_settings() const override { return true; }  // DOC: one configuration, until a factory reset
  protocol::ChangeSettings initial_settings(const protocol::DeviceState& device) const override { return change_to({}, device); }
  double gain_percent(const protocol::DeviceState&) const override { return 0; }  // the device sets its gain itself
  std::optional<protocol::ChangeSettings> after_ping(const Ping& ping, const protocol::DeviceState& device) const override {
    const Measurement measured = measured_in(ping);
    Settings s = settings_from(device.settings.get());
    s.reckoning = reckoned(s.reckoning, measured, ping.request, s);
    // The search among range modes continues only after a ping of the present mode. A ping that was fired before a client changed
    // the mode does not show whether the new mode fits.
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
    return std::make_shared<const protocol::Bytes>(velocity_line(measured, since_last(ping, device), sent_at(measured, device)));
  }
  std::optional<Time> leaves_at(const Ping& ping, const protocol::DeviceState& device) const override {
    return wanted_delay_ms(device) ? std::optional(sent_at(measured_in(ping), device)) : std::nullopt;
  }
  std::vector<protocol::Bytes> datagrams(const protocol::Port& port, const Ping& ping,
                                         const protocol::DeviceState& device) const override {
    if (port.number != serial_port) return {};  // the other port sends frame()
    const Measurement measured = measured_in(ping);
    const SerialOutput output = settings_from(device.settings.get()).serial_output;
    Bytes lines = velocity_sentences(measured, since_last(ping, device), sent_at(measured, device), output);
    if (lines.empty()) return {};
    return {std::move(lines)};
  }

 private:
  /// Returns the time since the previous report, which a report states; 0 for the first report.
  static std::chrono::nanoseconds since_last(const Ping& ping, const protocol::DeviceState& device) {
    const Time before = device.framed_at, fired = ping.request.fired_at;
    return before != Time{} && fired > before ? fired - before : std::chrono::nanoseconds(0);
  }
  static Time sent_at(const Measurement& measured, const protocol::DeviceState& device) {
    return measured.heard_at + nanoseconds_from(1e-3 * wanted_delay_ms(device).value_or(assumed_delay_ms));
  }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<DvlVendor>(); }

}  // namespace sonar::dvl
