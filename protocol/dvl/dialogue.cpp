#include "protocol/dvl/dialogue.hpp"

#include <utility>

#include "protocol/dvl/commands.hpp"
#include "protocol/dvl/reports.hpp"
#include "protocol/held_settings.hpp"

namespace sonar::dvl {
namespace {

using protocol::Reaction;

constexpr std::size_t longest_command = 4096;
constexpr int deepest_command = 8, most_waiting = 15;  // nested braces (chosen); triggered pings that may wait (DOC)
constexpr std::chrono::nanoseconds report_period = std::chrono::milliseconds(200);
constexpr auto longest_wait = std::chrono::seconds(2);  // after that a triggered ping counts as lost and is requested again

/// Finds the JSON objects in a stream by counting braces. Lines do not separate them: libwaterlinked sends no line ends.
class ObjectSplitter {
 public:
  /// Returns the object that ends with this byte.
  std::optional<std::string> add(char c) {
    if (depth_ == 0) {
      if (c == '{') {
        object_ = c;
        depth_ = 1;
        in_text_ = escapes_ = false;
      } else if (c != '\n' && c != '\r' && c != ' ' && c != '\t') {
        ++junk_;
      }
      return std::nullopt;
    }
    object_ += c;
    if (in_text_) {  // braces within a text do not count, and an escaped quote does not end it
      if (!std::exchange(escapes_, !escapes_ && c == '\\') && c == '"') in_text_ = false;
    } else if (c == '"') {
      in_text_ = true;
    } else if (c == '{') {
      ++depth_;
    } else if (c == '}' && --depth_ == 0) {
      return std::exchange(object_, {});
    }
    // An object that is too long or too deep is dropped. What follows it is read as a new stream.
    if (object_.size() < longest_command && depth_ <= deepest_command) return std::nullopt;
    junk_ += object_.size();
    depth_ = 0;
    object_.clear();
    return std::nullopt;
  }
  std::size_t take_junk() { return std::exchange(junk_, 0); }

 private:
  std::string object_;
  int depth_ = 0;
  bool in_text_ = false, escapes_ = false;
  std::size_t junk_ = 0;
};

/// One client's conversation. Every client gets all reports. With acoustics enabled the device pings by itself and trigger_ping
/// is refused; with acoustics disabled it pings only for triggers, which each client queues for itself (`waiting_`).
class DvlDialogue final : public protocol::Dialogue {
 public:
  DvlDialogue(const protocol::DeviceState& device, Time now) : device_(device), due_(next_report_after(now)) {}

  Reaction on_bytes(BytesView received, Time now) override {
    Reaction reaction;
    for (const std::byte b : received)
      if (const auto object = splitter_.add(static_cast<char>(b))) on_object(*object, now, reaction);
    if (const std::size_t junk = splitter_.take_junk(); junk > 0)
      reaction.events.emplace_back(protocol::Notice{std::to_string(junk) + " bytes that are no command"});
    return reaction;
  }

  Reaction on_tick(Time now, bool ping_pending) override {
    Reaction reaction;
    if (now < due_) return reaction;
    due_ = next_report_after(now);
    reaction.replies.push_back(position_line(extrapolated(settings().reckoning, now), now));
    if (waiting_ > 0 && now - requested_at_ > longest_wait && !ping_pending) {
      requested_at_ = now;
      reaction.events.emplace_back(protocol::RequestPing{});
    }
    return reaction;
  }
  Time next_tick() const override { return due_; }
  void on_ping_queued(Time) override {}
  // Every client gets every ping, also those that another client has triggered; each counts them for its own triggers.
  protocol::Delivery on_ping(const VendorSettings*, std::size_t, Time now) override {
    protocol::Delivery delivery{{Bytes{}}, {}};
    if (waiting_ > 0 && --waiting_ > 0) {
      requested_at_ = now;
      delivery.events.emplace_back(protocol::RequestPing{});
    }
    return delivery;
  }

 private:
  /// Reports of dead reckoning come at multiples of the period, so that all clients get them at the same times.
  static Time next_report_after(Time now) { return now - now.time_since_epoch() % report_period + report_period; }
  Settings settings() const { return settings_from(device_.settings.get()); }
  /// The settings after the changes of this call, which the daemon has not made yet.
  Settings settings_after(const Reaction& reaction) const {
    return settings_from(protocol::settings_after(reaction, device_.settings.get()));
  }

  void on_object(const std::string& object, Time now, Reaction& reaction) {
    const Json message = Json::parse(object, nullptr, false);
    const auto named = message.is_object() ? message.find("command") : message.end();
    if (named == message.end() || !named->is_string()) {
      reaction.replies.push_back(response_line("", {.error = "the message is no command"}));
      return;
    }
    const std::string command = named->get<std::string>();
    Settings s = settings_after(reaction);
    const auto before = s.configured();
    if (command == "trigger_ping") return trigger(std::move(s), now, reaction);
    const auto parameters = message.find("parameters");
    const auto outcome = carry_out(command, parameters != message.end() ? *parameters : Json(), device_, now, s);
    if (s.configured() != before || command == "reset_dead_reckoning") reaction.events.emplace_back(change_to(s, device_));
    if (s.acoustics) waiting_ = 0;  // enabled acoustics end the triggers
    reaction.replies.push_back(response_line(command, outcome.value_or(Outcome{.error = "there is no such command"})));
  }

  void trigger(Settings s, Time now, Reaction& reaction) {
    const auto answer = [&](std::string error) {
      reaction.replies.push_back(response_line("trigger_ping", {.error = std::move(error)}));
    };
    if (s.acoustics) return answer("acoustic_enabled must be false");
    if (waiting_ >= most_waiting) return answer("the queue is full");
    if (!s.is_triggered) {  // the rate of the settings is 0 while acoustics are disabled; a triggered ping needs another one
      s.is_triggered = true;
      reaction.events.emplace_back(change_to(s, device_));
    }
    if (++waiting_ == 1) {
      requested_at_ = now;
      reaction.events.emplace_back(protocol::RequestPing{});
    }
    answer({});
  }

  const protocol::DeviceState& device_;
  ObjectSplitter splitter_;
  Time due_;             // time of the next report of dead reckoning
  int waiting_ = 0;      // pings that this client has triggered and not got yet
  Time requested_at_{};  // when the first of them was requested
};

}  // namespace

std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, Time now) {
  return std::make_unique<DvlDialogue>(device, now);
}

}  // namespace sonar::dvl
