#include "protocol/ping/locate.hpp"
#include "protocol/ping/products.hpp"
#include "protocol/ping/streaming.hpp"
#include "protocol/ping/surveyor_settings.hpp"

namespace sonar::ping::surveyor {
namespace {

using protocol::Reaction;
constexpr auto port_table = streaming_ports(62312, "settings, points");
constexpr auto utc_period = std::chrono::seconds(10);

/// The dialogue with one host. The device requests the time from the host every 10 s, for the first time when the host enables
/// pings, or 10 s after the start. unknown: the time of the first request. A request at the start could be in the packet of the
/// answer for which ping-python waits; this would delay its initialization by 10 s, because ping-python reads one message of
/// each packet.
class SurveyorDialogue final : public StreamingConversation<Settings, settings_from> {
 public:
  SurveyorDialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now)
      : StreamingConversation(device, port), ask_utc_at_(now + utc_period) {}

  Reaction on_tick(Time now, bool) override {
    Reaction reaction;
    if (now < ask_utc_at_) return reaction;
    ask_utc_at_ = now + utc_period;
    has_asked_ = true;
    reaction.replies.push_back(framed(Id::utc_request, id_, {}));
    return reaction;
  }
  Time next_tick() const override { return ask_utc_at_; }

 protected:
  bool on_request(const Frame& frame, Time now, Reaction& reaction) override {
    switch (frame.header.id) {
      case Id::set_ping_parameters: {
        PingParameters parameters;
        if (!read(frame, parameters, reaction)) return true;
        if (const std::string why = complaint(parameters); !why.empty()) return refuse(frame, why, reaction), true;
        if (parameters.enable != 0 && !has_asked_) ask_utc_at_ = now;
        change(reaction, [&](Settings& s) { s.parameters = parameters; });
        return true;
      }
      case Id::utc_response: {
        UtcResponse response;
        if (read(frame, response, reaction) && response.utc_ms < 4000000000000)  // times after the year 2096 are invalid
          change(reaction,
                 [&](Settings& s) { s.utc_ahead = Time(std::chrono::milliseconds(response.utc_ms)) - (now + device_.skipped); });
        return true;
      }
      case Id::set_net_info: {
        NetInfo info;
        if (read(frame, info, reaction)) reaction.events.emplace_back(protocol::StoreAddress{{info.ntp_ip, info.netmask, false}});
        return true;
      }
      default:
        return false;
    }
  }
  bool on_wanted(Id wanted, Time now, Reaction&) override {
    if (wanted == Id::utc_request) ask_utc_at_ = now;
    return wanted == Id::utc_request;
  }
  Bytes message_now(Id wanted, Time) override {
    return wanted == Id::water_stats ? framed_message(wanted, id_, water_stats(device_)) : Bytes{};
  }
  bool comes_with_pings(Id wanted) const override {
    const PingParameters p = settings().parameters;
    return p.enable != 0 && (wanted == Id::attitude_report || (wanted == Id::atof_point_data && p.atof != 0) ||
                             (wanted == Id::yz_point_data && p.yz != 0));
  }

 private:
  Time ask_utc_at_;
  bool has_asked_ = false;
};

class SurveyorVendor final
    : public protocol::VendorWith<models, surveyor::apply_override, locate_surveyor, locate_surveyor, StreamingVendor> {
 public:
  std::string_view name() const override { return "surveyor240"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override { return streaming_options(); }
  protocol::ChangeSettings initial_settings(const protocol::DeviceState&) const override {
    Settings s;
    s.parameters.end_mm = 5000;
    return change_to(s);
  }
  double gain_percent(const protocol::DeviceState& device) const override {
    return std::max<int>(settings_from(device.settings.get()).parameters.gain, 0);
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port& port, const protocol::DeviceState& device,
                                               Time now) const override {
    return std::make_unique<SurveyorDialogue>(device, port, now);
  }

 protected:
  std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState& device) const override {
    return surveyor::frames_of(ping, device);
  }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<SurveyorVendor>(); }

}  // namespace sonar::ping::surveyor
