#include "protocol/ping/locate.hpp"
#include "protocol/ping/ping1d_settings.hpp"
#include "protocol/ping/products.hpp"
#include "protocol/ping/sounding.hpp"
#include "protocol/ping/streaming.hpp"

namespace sonar::ping::ping1d {
namespace {

using protocol::Reaction;

constexpr std::uint16_t firmware_major = 3, firmware_minor = 29, supply_mv = 5000;
constexpr double housing_above_water_c = 8;  // assumed

/// The dialogue with one host. Each setting has its own message; SoundingConversation fires the pings for the host's requests
/// and streams.
class Ping1DDialogue final : public SoundingConversation<Settings, HeldSettings, settings_from, results_of> {
 public:
  Ping1DDialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now)
      : SoundingConversation(device, port, {.revision = 1, .major = firmware_major, .minor = firmware_minor}, now) {}

 protected:
  bool on_request(const Frame& frame, Time now, Reaction& reaction) override {
    const Id id = frame.header.id;
    switch (id) {
      case Id::ping1d_set_device_id:
        set_id(frame, reaction);
        return true;
      case Id::ping1d_set_range: {
        ScanRange range;
        if (is_manual(frame, reaction) && read(frame, range, reaction))
          set(frame, reaction, [&](Parameters& p) { p.range = range; });
        return true;
      }
      case Id::set_sound_speed_before:
        set_value(frame, reaction, &Parameters::speed_mm_per_s);
        return true;
      case Id::ping1d_set_mode_auto:
        set_value(frame, reaction, &Parameters::mode_auto);
        return true;
      case Id::ping1d_set_interval:
        set_value(frame, reaction, &Parameters::interval_ms);
        return true;
      case Id::ping1d_set_gain:
        if (is_manual(frame, reaction)) set_value(frame, reaction, &Parameters::gain);
        return true;
      case Id::ping1d_set_enable:
        set_value(frame, reaction, &Parameters::enable);
        forget_ping(now);  // a requested ping may not come any more
        return true;
      case Id::ping1d_continuous_start:
      case Id::ping1d_continuous_stop:
        set_stream(frame, now, reaction);
        return true;
      case Id::ping1d_goto_bootloader:
        refuse(frame, "it has no bootloader", reaction);
        return true;
      default:  // older hosts request a message with its id, without a payload (CLI)
        if (frame.payload.empty()) answer(id, now, reaction);
        return frame.payload.empty();
    }
  }

 private:
  /// True in manual mode. In automatic mode the device determines range and gain, so the request is refused.
  bool is_manual(const Frame& frame, Reaction& reaction) const {
    const bool manual = settings_after(reaction).parameters.mode_auto == 0;
    if (!manual) refuse(frame, "the mode is automatic", reaction);
    return manual;
  }

  /// Starts or stops the stream of one message. Streams of several messages can run at the same time: each ping then has all of
  /// them.
  void set_stream(const Frame& frame, Time now, Reaction& reaction) {
    Id id{};
    wire::Reader reader(frame.payload);
    reader("id", id);
    if (!reader.ok()) return refuse(frame, reader.failure_text(), reaction);
    const Results result = results_of(id);
    if (result == no_result) return refuse(frame, "that message is not streamed", reaction);
    if (frame.header.id == Id::ping1d_continuous_start)
      stream(result, now, reaction);
    else
      stop_stream(result);
    reaction.replies.push_back(ack(frame.header.id, id_));
  }

  template <class Change>
  void set(const Frame& frame, Reaction& reaction, Change apply) {
    Parameters p = settings_after(reaction).parameters;
    apply(p);
    if (const std::string why = complaint(p); !why.empty()) return refuse(frame, why, reaction);
    change(reaction, [&](Settings& s) { s.parameters = p; });
    reaction.replies.push_back(ack(frame.header.id, id_));
  }
  template <class T>
  void set_value(const Frame& frame, Reaction& reaction, T Parameters::*member) {
    T value{};
    wire::Reader reader(frame.payload);
    reader("value", value);
    if (!reader.ok()) return refuse(frame, reader.failure_text(), reaction);
    set(frame, reaction, [&](Parameters& p) { p.*member = value; });
  }

  Bytes message_of(Id id, const Parameters& p) const override {
    switch (id) {
      case Id::ping1d_firmware_version:
        return framed_message(id, id_, FirmwareVersion{.major = firmware_major, .minor = firmware_minor});
      case Id::ping1d_device_id:
        return value(id, id_);
      case Id::ping1d_voltage_5:
        return value(id, supply_mv);
      case Id::ping1d_sound_speed:
        return value(id, p.speed_mm_per_s);
      case Id::ping1d_range:
        return framed_message(id, id_, p.range);
      case Id::ping1d_mode_auto:
        return value(id, p.mode_auto);
      case Id::ping1d_interval:
        return value(id, p.interval_ms);
      case Id::ping1d_gain:
        return value(id, std::uint32_t{p.gain});
      case Id::ping1d_transmit_duration:
        return value(id, transmit_us(p));
      case Id::ping1d_general_info:
        return framed_message(id, id_,
                              GeneralInfo{firmware_major, firmware_minor, supply_mv, p.interval_ms, p.gain, p.mode_auto});
      case Id::ping1d_processor_temperature:
        return value(id, centidegrees(2 * housing_above_water_c));
      case Id::ping1d_pcb_temperature:
        return value(id, centidegrees(housing_above_water_c));
      case Id::ping1d_enable:
        return value(id, p.enable);
      default:
        return {};
    }
  }
};

// The port of the bridge with which vehicles serve the serial line.
constexpr auto port_table = streaming_ports(9090, "settings, distances, profiles");

class Ping1DVendor final
    : public protocol::VendorWith<models, ping1d::apply_override, locate_ping1d, locate_ping1d, SoundingVendor> {
 public:
  std::string_view name() const override { return "ping1d"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override {
    static const std::array<protocol::Option, 2> all{
        {type_option("1", "number of the product in its device information"), silence_option()}};
    return all;
  }
  protocol::ChangeSettings initial_settings(const protocol::DeviceState&) const override { return change_to(Settings{}); }
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
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port& port, const protocol::DeviceState& device,
                                               Time now) const override {
    return std::make_unique<Ping1DDialogue>(device, port, now);
  }

 protected:
  std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState&) const override { return ping1d::frames_of(ping); }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<Ping1DVendor>(); }

}  // namespace sonar::ping::ping1d
