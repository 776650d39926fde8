#include "protocol/ping/locate.hpp"
#include "protocol/ping/omniscan_messages.hpp"
#include "protocol/ping/ping1d_messages.hpp"
#include "protocol/ping/products.hpp"
#include "protocol/ping/s500_settings.hpp"
#include "protocol/ping/sounding.hpp"

namespace sonar::ping::s500 {
namespace {

using protocol::Reaction;

constexpr auto port_table = streaming_ports(51200, "settings, profiles");
constexpr std::uint16_t firmware_major = 2, firmware_minor = 2;
constexpr double processor_above_water_c = 20;  // assumed

/// The dialogue with one host. One message, set_ping_params (1015), sets all except the sound speed, and starts or ends the
/// pings; SoundingConversation fires the pings.
class S500Dialogue final : public SoundingConversation<Settings, HeldSettings, settings_from, results_of> {
 public:
  S500Dialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now)
      : SoundingConversation(device, port, {.major = firmware_major, .minor = firmware_minor}, now) {}

 protected:
  bool on_request(const Frame& frame, Time now, Reaction& reaction) override {
    if (frame.header.id == Id::s500_set_ping_params) {
      SetPingParams wanted;
      if (!read(frame, wanted, reaction)) return true;
      if (const std::string why = complaint(wanted); !why.empty()) return refuse(frame, why, reaction), true;
      change(reaction, [&](Settings& s) { s.parameters = requested(s.parameters, wanted); });
      // This request replaces the previous one, to which a ping in progress and the stream belong.
      forget_ping(now);
      stop_stream(~no_result);
      const Results result = results_of(wanted.report);
      if (result != no_result && wanted.period_ms < 0) want_once(result, now, reaction);
      if (result != no_result && wanted.period_ms >= 0) stream(result, now, reaction);
      reaction.replies.push_back(ack(frame.header.id, id_));
      return true;
    }
    if (frame.header.id == Id::set_sound_speed_before) {
      SoundSpeed speed;
      if (!read(frame, speed, reaction)) return true;
      if (speed.mm_per_s < 1000000 || speed.mm_per_s > 2000000)
        return refuse(frame, "sos_mm_per_sec is not in 1000000..2000000", reaction), true;
      change(reaction, [&](Settings& s) { s.parameters.speed_mm_per_s = speed.mm_per_s; });
      reaction.replies.push_back(ack(frame.header.id, id_));
      return true;
    }
    // The maker's description allows requests with the id of the requested message, without a payload.
    if (frame.payload.empty()) answer(frame.header.id, now, reaction);
    return frame.payload.empty();
  }

 private:
  Bytes message_of(Id id, const Parameters& p) const override {
    switch (id) {
      case Id::ping1d_firmware_version:
        return framed_message(id, id_, FirmwareVersion{.type = 0, .model = 0, .major = firmware_major, .minor = firmware_minor});
      case Id::ping1d_sound_speed:
        return value(id, p.speed_mm_per_s);
      case Id::ping1d_range:
        return framed_message(id, id_, ScanRange{p.ping.start_mm, p.reach.length_mm});
      case Id::ping1d_interval:
        return value(id, static_cast<std::uint16_t>(interval_ms(p)));
      case Id::ping1d_gain:
        return value(id, static_cast<std::uint32_t>(p.reach.gain));
      case Id::ping1d_processor_temperature:
        return value(id, std::uint32_t{centidegrees(processor_above_water_c)});
      default:
        return {};
    }
  }
};

class S500Vendor final : public protocol::VendorWith<models, s500::apply_override, locate_s500, locate_s500, SoundingVendor> {
 public:
  std::string_view name() const override { return "s500"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override { return streaming_options(); }
  protocol::ChangeSettings initial_settings(const protocol::DeviceState&) const override { return change_to(Settings{}); }
  double gain_percent(const protocol::DeviceState& device) const override {
    return s500::gain_percent(settings_from(device.settings.get()).parameters);
  }
  std::optional<protocol::ChangeSettings> after_ping(const Ping& ping, const protocol::DeviceState& device) const override {
    return change_to(after(ping, settings_from(device.settings.get())));
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port& port, const protocol::DeviceState& device,
                                               Time now) const override {
    return std::make_unique<S500Dialogue>(device, port, now);
  }

 protected:
  std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState& device) const override {
    return s500::frames_of(ping, device);
  }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<S500Vendor>(); }

}  // namespace sonar::ping::s500
