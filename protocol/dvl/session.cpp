#include "protocol/dvl/session.hpp"

namespace sonar::dvl {
namespace {

using protocol::Reaction;

constexpr int most_waiting = 15;  // triggered pings (DOC)
constexpr std::chrono::nanoseconds report_period = std::chrono::milliseconds(200);
constexpr auto longest_wait = std::chrono::seconds(2);  // a triggered ping that takes longer is lost and requested again

}  // namespace

/// Reports of dead reckoning come at multiples of the period, so that all clients get them at the same times.
Time Session::next_report_after(Time now) { return now - now.time_since_epoch() % report_period + report_period; }

Reaction Session::on_tick(Time now, bool ping_pending) {
  Reaction reaction;
  if (now < due_) return reaction;
  due_ = next_report_after(now);
  protocol::Bytes report = device_.model == recorded_model() ? protocol::Bytes{} : position_report(now);
  if (!report.empty()) reaction.replies.push_back(std::move(report));
  if (waiting_ > 0 && now - requested_at_ > longest_wait && !ping_pending) {
    requested_at_ = now;
    reaction.events.emplace_back(protocol::RequestPing{});
  }
  return reaction;
}

// Every client gets every ping, also those that another client has triggered; each counts them for its own triggers.
protocol::Delivery Session::on_ping(const VendorSettings*, std::size_t, Time now) {
  protocol::Delivery delivery{{protocol::Bytes{}}, {}};
  if (waiting_ > 0 && --waiting_ > 0) {
    requested_at_ = now;
    delivery.events.emplace_back(protocol::RequestPing{});
  }
  return delivery;
}

std::optional<Outcome> Session::execute(const std::string& command, const Json& parameters, Time now, Reaction& reaction) {
  Settings s = settings_after(reaction);
  if (command == "trigger_ping") return trigger(std::move(s), now, reaction);
  const auto before = s.configured();
  auto outcome = carry_out(command, parameters, device_, now, s);
  if (s.configured() != before || command == "reset_dead_reckoning") reaction.events.emplace_back(change_to(s, device_));
  if (s.acoustics) waiting_ = 0;  // enabled acoustics end the triggers
  return outcome;
}

Outcome Session::trigger(Settings s, Time now, Reaction& reaction) {
  if (s.acoustics) return {.error = "acoustic_enabled must be false"};
  if (waiting_ >= most_waiting) return {.error = "the queue is full"};
  if (!s.is_triggered) {  // the rate of the settings is 0 while acoustics are disabled; a triggered ping needs another rate
    s.is_triggered = true;
    reaction.events.emplace_back(change_to(s, device_));
  }
  if (++waiting_ == 1) {
    requested_at_ = now;
    reaction.events.emplace_back(protocol::RequestPing{});
  }
  return {};
}

}  // namespace sonar::dvl
