// The part that the dialogues with range finders (Ping1D, S500) share: each ping is fired for results that a host has
// requested, once or as a stream.
#pragma once

#include <cmath>
#include <utility>

#include "protocol/ping/conversation.hpp"
#include "protocol/ping/echo.hpp"

namespace sonar::ping {

/// A ping is requested while results are requested (`once_`, `streamed_`); the daemon fires it when the interval is over. The
/// next ping is requested only after this ping has arrived or two seconds have passed. `Settings` are those of a
/// StreamingConversation, with `results`: the results for which a ping is fired. `Held` has the settings. results_of() returns
/// the result in a message.
template <class Settings, class Held, Settings (*settings_from)(const VendorSettings*), Results (*results_of)(Id)>
class SoundingConversation : public StreamingConversation<Settings, settings_from> {
  using Base = StreamingConversation<Settings, settings_from>;
  static constexpr auto longest_wait = std::chrono::seconds(2);  // time after which a ping counts as lost

 public:
  SoundingConversation(const protocol::DeviceState& device, const protocol::Port& port, DeviceInformation identity, Time now)
      : Base(device, port, identity), due_(now) {}

  protocol::Reaction on_tick(Time now, bool ping_pending) override {
    protocol::Reaction reaction;
    if (now < next_tick()) return reaction;
    if (fired_ && ping_pending) return fired_at_ = now, reaction;  // the interval is not over
    Settings s = this->settings();
    s.id = this->id_;
    s.results = wanted();
    fired_ = std::make_shared<Held>(s);
    fired_at_ = now;
    reaction.events.emplace_back(protocol::RequestPing{.joins = false, .head_rad = 0, .with = fired_});
    return reaction;
  }
  Time next_tick() const override {
    if (wanted() == no_result || this->settings().parameters.enable == 0) return Time::max();
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
  Bytes message_now(Id, Time) override { return {}; }
  /// Returns a message that needs no ping; empty if the product has no such message.
  virtual Bytes message_of(Id id, const decltype(Settings::parameters)& parameters) const = 0;
  /// Sends results with the next ping, and other values at once.
  bool on_wanted(Id id, Time now, protocol::Reaction& reaction) override {
    const auto p = this->settings_after(reaction).parameters;
    const Results result = results_of(id);
    if (result != no_result && p.enable != 0) return want_once(result, now, reaction), true;
    Bytes message = result != no_result ? nack(id, this->id_, "pings are disabled") : message_of(id, p);
    if (message.empty()) return false;
    reaction.replies.push_back(std::move(message));
    return true;
  }

  Results wanted() const { return once_ | streamed_; }
  void want_once(Results result, Time now, protocol::Reaction& reaction) { want(once_, result, now, reaction); }
  void stream(Results result, Time now, protocol::Reaction& reaction) { want(streamed_, result, now, reaction); }
  void stop_stream(Results result) { streamed_ &= ~result; }
  /// Ends the wait for the ping that is being computed, so that the next is due now. Results that are requested are still sent.
  void forget_ping(Time now) {
    fired_.reset();
    due_ = now;
  }
  template <class T>
  Bytes value(Id id, T value) const {
    Bytes payload;
    wire::Writer write(payload);
    write("value", value);
    return framed(id, this->id_, payload);
  }
  /// Returns the temperature of the water plus `above_c`, in hundredths of a degree.
  std::uint16_t centidegrees(double above_c) const {
    return static_cast<std::uint16_t>(std::lround(std::max(100 * (this->device_.water.temperature_c + above_c), 0.0)));
  }

 private:
  /// Requests `result`. A ping that is being computed serves the request only if it was fired for the same result.
  void want(Results& results, Results result, Time now, protocol::Reaction& reaction) {
    // The initial settings enable pings, but the sonar pings only after a first change of settings: this one.
    if (!std::exchange(has_asked_, true)) this->change(reaction, [](Settings&) {});
    if (wanted() == no_result) due_ = now;
    results |= result;
  }

  Results once_ = no_result, streamed_ = no_result;  // results for which the host waits
  Time due_{};                                       // time of the next requested ping, if none is being computed
  std::shared_ptr<const Held> fired_;                // the ping that is being computed
  Time fired_at_{};
  bool has_asked_ = false;
};

class SoundingVendor : public StreamingVendor {
 public:
  bool measures_distance() const override { return true; }
  std::optional<protocol::Distance> distance_in(const Ping& ping) const override {
    const Echo echo = echo_in(ping);
    return protocol::Distance{echo.range_m, echo.confidence};
  }
};

}  // namespace sonar::ping
