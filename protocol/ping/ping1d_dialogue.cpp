#include "protocol/ping/ping1d_dialogue.hpp"

#include <cmath>
#include <utility>

#include "protocol/ping/ping1d_settings.hpp"
#include "protocol/ping/streaming.hpp"

namespace sonar::ping::ping1d {
namespace {

using protocol::Reaction;

constexpr auto longest_wait = std::chrono::seconds(2);  // after that a ping is taken as lost
constexpr std::uint16_t firmware_major = 3, firmware_minor = 29, supply_mv = 5000;
constexpr double housing_above_water_c = 8;  // assumed

class Ping1DDialogue final : public StreamingConversation<Settings, settings_from> {
 public:
  Ping1DDialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now)
      : StreamingConversation(device, port, {.revision = 1, .major = firmware_major, .minor = firmware_minor}), due_(now) {}

  Reaction on_tick(Time now, bool ping_pending) override {
    Reaction reaction;
    if (now < next_tick()) return reaction;
    if (fired_ && ping_pending) return fired_at_ = now, reaction;  // the interval is not over
    Settings s = settings();
    s.id = id_;
    s.results = wanted();
    fired_ = std::make_shared<HeldSettings>(s);
    fired_at_ = now;
    reaction.events.emplace_back(protocol::RequestPing{.joins = false, .head_rad = 0, .with = fired_});
    return reaction;
  }
  Time next_tick() const override {
    if (wanted() == no_result || !is_enabled()) return Time::max();
    return fired_ ? fired_at_ + longest_wait : due_;
  }
  std::optional<Time> next_ping_request() const override {
    return next_tick() != Time::max() && !fired_ ? std::optional(due_) : std::nullopt;
  }
  bool hosts_fall_silent() const override { return streamed_ != no_result; }
  protocol::Delivery on_ping(const VendorSettings* made_with, std::size_t, Time now) override {
    const Results results = settings_from(made_with).results;
    if (made_with == fired_.get()) {
      fired_.reset();
      due_ = now;
    }
    if ((results & wanted()) == 0) return {};
    once_ &= ~results;
    return {{Bytes{}}, {}};
  }

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
        fired_.reset();  // its request ends with the pings
        due_ = now;
        return true;
      case Id::ping1d_continuous_start:
      case Id::ping1d_continuous_stop:
        stream(frame, now, reaction);
        return true;
      case Id::ping1d_goto_bootloader:
        refuse(frame, "it has no bootloader", reaction);
        return true;
      default:  // a request of older hosts: the number of the message, without a payload
        if (frame.payload.empty()) answer(id, now, reaction);
        return frame.payload.empty();
    }
  }

  bool on_wanted(Id wanted_id, Time now, Reaction& reaction) override {
    const Settings s = settings_after(reaction);
    if (const Results result = results_of(wanted_id); result != no_result) {
      if (s.parameters.enable == 0)
        reaction.replies.push_back(nack(wanted_id, id_, "pings are disabled"));
      else
        want(once_, result, now, reaction);
      return true;
    }
    if (Bytes message = message_of(wanted_id, s.parameters); !message.empty())
      return reaction.replies.push_back(std::move(message)), true;
    return false;
  }
  Bytes message_now(Id, Time) override { return {}; }

 private:
  Results wanted() const { return once_ | streamed_; }
  /// In automatic mode the device sets range and gain itself, so these requests are refused.
  bool is_manual(const Frame& frame, Reaction& reaction) const {
    const bool manual = settings_after(reaction).parameters.mode_auto == 0;
    if (!manual) refuse(frame, "the mode is automatic", reaction);
    return manual;
  }
  bool is_enabled() const { return settings().parameters.enable != 0; }
  /// A ping under way does not serve the new request; the next ping does.
  void want(Results& results, Results result, Time now, Reaction& reaction) {
    if (!std::exchange(has_asked_, true)) change(reaction, [](Settings&) {});  // pings are enabled as it comes: now they are made
    if (wanted() == no_result) due_ = now;
    results |= result;
  }

  void stream(const Frame& frame, Time now, Reaction& reaction) {
    Id id{};
    wire::Reader reader(frame.payload);
    reader("id", id);
    if (!reader.ok()) return refuse(frame, reader.failure_text(), reaction);
    const Results result = results_of(id);
    if (result == no_result) return refuse(frame, "that message is not streamed", reaction);
    if (frame.header.id == Id::ping1d_continuous_start) {
      want(streamed_, result, now, reaction);
    } else {
      streamed_ &= ~result;
    }
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

  template <class T>
  Bytes value(Id id, T value) const {
    Bytes payload;
    wire::Writer write(payload);
    write("value", value);
    return framed(id, id_, payload);
  }
  Bytes message_of(Id id, const Parameters& p) const {
    const auto centidegrees = [&](double above_c) {
      return static_cast<std::uint16_t>(std::lround(std::max(100 * (device_.water.temperature_c + above_c), 0.0)));
    };
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

  Results once_ = no_result, streamed_ = no_result;  // results that the host waits for
  Time due_{};                                       // when the next requested ping is due, if none is under way
  std::shared_ptr<const HeldSettings> fired_;        // the ping that is being made
  Time fired_at_{};
  bool has_asked_ = false;
};

}  // namespace

std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now) {
  return std::make_unique<Ping1DDialogue>(device, port, now);
}

}  // namespace sonar::ping::ping1d
