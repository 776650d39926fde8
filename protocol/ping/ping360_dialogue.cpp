#include <algorithm>

#include "protocol/awaited_ping.hpp"
#include "protocol/ping/conversation.hpp"
#include "protocol/ping/ping360_settings.hpp"

namespace sonar::ping::ping360 {
namespace {

using protocol::Reaction;

DeviceInformation identity(const protocol::OptionValues& options) {
  DeviceInformation info;
  info.type = static_cast<std::uint8_t>(number_option(options, sonar::ping::option_name::device_type));
  int major = 0, minor = 0, patch = 0;
  std::sscanf(std::string(text_option(options, option_name::firmware)).c_str(), "%d.%d.%d", &major, &minor, &patch);
  info.major = static_cast<std::uint8_t>(major);
  info.minor = static_cast<std::uint8_t>(minor);
  info.patch = static_cast<std::uint8_t>(patch);
  return info;
}

/// One host's conversation: a request starts a task (`Task`), which replaces the one in progress. Each ping of a task has two
/// waits: until the head has turned (`due_`), then until the ping is computed (`awaited_`). on_tick() ends the first, on_ping()
/// the second.
class Ping360Dialogue final : public Conversation {
 public:
  Ping360Dialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now)
      : Conversation(device, port, identity(device.options), Settings{}.id), head_{0, 0, now} {}

  Reaction on_tick(Time now, bool ping_pending) override {
    Reaction reaction;
    if (now < next_tick()) return reaction;
    if (awaited_.is_under_way()) {
      if (awaited_.lose(ping_pending, now)) advance(now);  // the ping is late: the scan continues without it
      return reaction;
    }
    Settings s = settings();
    s.id = id_;
    s.ping.angle = head_.target();
    // The head has arrived. A request without transmission is answered by message 2300 without samples.
    if (task_ == Task::turn) {
      reaction.replies.push_back(state_message(now));
      task_ = Task::none;
      return reaction;
    }
    const auto with = std::make_shared<const HeldSettings>(s);
    awaited_.begin(with, now);
    reaction.events.emplace_back(
        protocol::RequestPing{.joins = false, .head_rad = ping360::head_rad(s.ping.angle, device_.options), .with = with});
    return reaction;
  }
  Time next_tick() const override {
    if (task_ == Task::none) return Time::max();
    return awaited_.is_under_way() ? awaited_.lost_at() : due_;
  }
  std::optional<Time> next_ping_request() const override {
    return task_ != Task::none && !awaited_.is_under_way() ? std::optional(due_)
                                                           : std::nullopt;  // stepped time also stops at the end of a turn
  }
  bool hosts_fall_silent() const override { return task_ != Task::none; }  // ping-python sends nothing while it scans
  protocol::Delivery on_ping(const VendorSettings* made_with, std::size_t, Time now) override {
    const auto arrival = awaited_.arrive(made_with);
    if (arrival == protocol::AwaitedPing::Arrival::other) return {};
    if (arrival == protocol::AwaitedPing::Arrival::awaited) advance(now);
    return {{Bytes{}}, {}};
  }

 protected:
  /// 2601 and 2602 begin a task and are answered by its pings; the others are acknowledged.
  bool on_request(const Frame& frame, Time now, Reaction& reaction) override {
    switch (frame.header.id) {
      case Id::transducer: {
        Transducer t;
        if (read(frame, t, reaction)) begin(frame, t, now, reaction);
        return true;
      }
      case Id::auto_transmit: {
        AutoTransmit t;
        if (read(frame, t, reaction)) begin(frame, t, now, reaction);
        return true;
      }
      case Id::motor_off:
        stop(now);
        reaction.replies.push_back(ack(frame.header.id, id_));
        return true;
      case Id::reset:
        stop(now);
        reaction.events.emplace_back(change_to(Settings{}, device_));
        reaction.replies.push_back(ack(frame.header.id, id_));
        return true;
      case Id::ping360_set_device_id:
        set_id(frame, reaction);
        return true;
      default:
        return false;
    }
  }

  Bytes message_now(Id wanted, Time now) override { return wanted == Id::device_data ? state_message(now) : Bytes{}; }

 private:
  /// turn: sends 2300 without samples when the head has arrived. ping: fires one ping then. scan: pings and turns until another
  /// request.
  enum class Task { none, turn, ping, scan };

  Settings settings() const { return settings_from(device_.settings.get()); }

  /// Message 2300 without samples: the settings and the present angle of the head.
  Bytes state_message(Time now) const {
    const Transducer t = settings().ping;
    return framed_message(Id::device_data, id_,
                          DeviceData{t.mode, t.gain, head_.angle_at(now), t.transmit_us, t.period, t.khz, t.samples, 0});
  }

  /// A valid request replaces the one in progress. A refused request has no effect on it.
  template <class Request>
  void begin(const Frame& frame, const Request& request, Time now, Reaction& reaction) {
    if (const std::string why = complaint(request); !why.empty()) return refuse(frame, why, reaction);
    const Settings s = settings_of(request);
    stop(now);
    task_ = s.scans ? Task::scan : s.ping.transmit != 0 ? Task::ping : Task::turn;
    back_ = false;
    head_.turn_to(s.ping.angle, now);
    due_ = head_.arrives();
    reaction.events.emplace_back(change_to(s, device_));
  }

  /// The head stops where it is, also in the middle of a turn. A ping that still comes is not sent.
  void stop(Time now) {
    task_ = Task::none;
    awaited_.forget();
    head_ = {head_.angle_at(now), head_.angle_at(now), now};
  }

  /// Ends the ping that was awaited. The next ping of a scan is due after the samples have been taken and sent, and the head has
  /// turned.
  void advance(Time now) {
    if (task_ != Task::scan) {
      task_ = Task::none;
      return;
    }
    const Settings s = settings();
    const auto after = listening(s.ping) + transfer(s.ping, device_.options) + std::chrono::milliseconds(s.delay_ms);
    const Time turns_at = awaited_.fired_at() + after;
    const bool oscillates = text_option(device_.options, option_name::sector_scan) != "wrap";
    head_.turn_to(next_angle(head_.target(), s, back_, oscillates), turns_at);
    // After a late ping the scan does not catch up: the next one is due now at the earliest.
    due_ = std::max(head_.arrives(), now);
  }

  Head head_;
  Task task_ = Task::none;
  bool back_ = false;  // a scan that oscillates is on its way back to the start angle
  Time due_{};
  protocol::AwaitedPing awaited_;
};

}  // namespace

std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now) {
  return std::make_unique<Ping360Dialogue>(device, port, now);
}

}  // namespace sonar::ping::ping360
