#include <algorithm>
#include <deque>
#include <iterator>
#include <string_view>

#include "core/text/ipv4.hpp"
#include "protocol/aris/aris.hpp"
#include "protocol/aris/messages.hpp"
#include "protocol/aris/settings.hpp"

namespace sonar::aris {
namespace {

using protocol::DeviceState;
using protocol::Notice;
using protocol::Reaction;

constexpr std::size_t most_waiting = 256;    // changes of settings that a fault (D01, D02) may delay
constexpr std::size_t notices_per_call = 8;  // bounds the log output that a hostile controller can cause

bool is_multicast(protocol::Ipv4 ip) { return ip[0] >= 224 && ip[0] < 240; }

/// The dialogue with one controller (docs/protocols/aris.md, "Session"). The device never answers over TCP; beacons and frame
/// headers report its state. It sends frames once it has valid acoustic settings and a receiver, in any order.
class ArisDialogue final : public protocol::Dialogue {
 public:
  explicit ArisDialogue(const DeviceState& device) : device_(device), seen_(device.settings), first_ping_(device.last_ping) {}

  Reaction on_bytes(protocol::BytesView received, Time now) override {
    Reaction reaction;
    notices_ = 0;
    // All commands of one call result in one change of settings.
    settings_ = base();
    settings_.streaming |= streaming_;
    // frame_index counts from the first ping of a connection. If several controllers are connected, the first connection counts.
    settings_.first_ping = std::min(settings_.first_ping, first_ping_);
    changed_ = false;
    framer_.append(received);
    while (const auto message = framer_.next()) on_message(*message, now, reaction);
    if (changed_) command_change(reaction);
    if (framer_.broken()) reaction.events.emplace_back(protocol::Close{"states a command longer than 4096 bytes"});
    return reaction;
  }
  Reaction on_tick(Time, bool) override { return {}; }
  Time next_tick() const override { return Time::max(); }
  std::optional<std::chrono::milliseconds> longest_silence() const override {
    return std::chrono::milliseconds(static_cast<int>(1000 * number_option(device_.options, option_name::silence_s)));
  }
  void on_ping_queued(Time) override {}

 private:
  /// Returns the settings that the next command changes: the settings after the last command, even if a fault delays their use,
  /// or the device's settings, if for example the control interface has changed them since then.
  Settings base() {
    if (device_.settings != seen_) {
      const auto applied = std::find(waiting_.begin(), waiting_.end(), device_.settings);
      waiting_.erase(waiting_.begin(), applied == waiting_.end() ? applied : std::next(applied));
      seen_ = device_.settings;
    }
    return settings_from((waiting_.empty() ? seen_ : waiting_.back()).get(), device_);
  }
  void command_change(Reaction& reaction) {
    protocol::ChangeSettings change = change_to(settings_, device_);
    waiting_.push_back(change.vendor_settings);
    if (waiting_.size() > most_waiting) waiting_.pop_front();
    reaction.events.emplace_back(std::move(change));
  }

  void on_message(BytesView message, Time now, Reaction& reaction) {
    Command command;
    if (!protobuf::read(message, command))
      return notice(reaction, "ignored a command of " + std::to_string(message.size()) + " bytes that cannot be read");
    if (command.type != CommandType::set_acoustics) report_refusals(reaction);
    switch (command.type) {
      case CommandType::set_date_time:
        return on_date_time(command, now, reaction);
      case CommandType::set_receiver:
        return on_receiver(command, reaction);
      case CommandType::set_stream:
        return on_stream(command);
      case CommandType::set_acoustics:
        return on_acoustics(command);
      case CommandType::set_salinity:
        return on_salinity(command, reaction);
      case CommandType::set_telephoto:
        settings_.telephoto = command.telephoto && command.telephoto->value != 0;
        changed_ = true;
        return;
      case CommandType::set_focus:
        return on_focus(command.focus.value_or(Focus{}), now);
      case CommandType::home_focus:
        return move_focus(0, now);
      case CommandType::ping:
        return;
      default:  // FORCE_FOCUS, a rotator and a log receiver are not emulated
        return notice(reaction, "ignored a command of type " + std::to_string(static_cast<unsigned>(command.type)));
    }
  }

  void on_date_time(const Command& command, Time now, Reaction& reaction) {
    const auto date_time = parse_date_time(command.date_time ? command.date_time->text : std::string());
    if (!date_time) return notice(reaction, "ignored a date and time that cannot be read");
    settings_.clock_offset = *date_time - (now + device_.skipped);  // it is added to the stamps of pings
    changed_ = true;
  }

  /// Handles SET_FRAMESTREAM_RECEIVER. In the command an empty address is the controller's and "0.0.0.0" stops the frames; in
  /// SetReceivers 0.0.0.0 is the controller's address and an empty list stops the frames.
  void on_receiver(const Command& command, Reaction& reaction) {
    const Receiver wanted = command.receiver.value_or(Receiver{});
    protocol::SetReceivers receivers;
    protocol::Endpoint to{{}, static_cast<std::uint16_t>(wanted.port)};
    const bool starts = wanted.ip != "0.0.0.0";
    if (starts) {
      if (wanted.port == 0 || wanted.port > 65535) return notice(reaction, "ignored a receiver without a port");
      if (!wanted.ip.empty()) {
        const auto ip = text::parse_ipv4(wanted.ip);
        if (!ip) return notice(reaction, "ignored SET_FRAMESTREAM_RECEIVER: not an IPv4 address");
        to.ip = *ip;
        const bool own = *ip == device_.connected_client || is_multicast(*ip);
        if (!own && text_option(device_.options, option_name::receivers) == "controller")
          return notice(reaction, "ignored a receiver at another host (option receivers: controller)");
      }
      receivers.to.push_back(to);
    }
    settings_.streaming = streaming_ = starts;
    reaction.events.emplace_back(receivers);
    changed_ = true;
  }

  void on_stream(const Command& command) {
    if (!command.stream || !command.stream->delay) return;
    settings_.delays_packets = command.stream->delay->enable;
    settings_.packet_delay_us = command.stream->delay->microseconds;
    changed_ = true;
  }

  /// Handles SET_ACOUSTICS. A controller without information about the product sends settings for each product, one after the
  /// other, and the device accepts those for itself. So refusals are logged only if the device accepted none of these settings,
  /// which is known at the next command of another type, for example the keep-alive, which is sent every second.
  void on_acoustics(const Command& command) {
    const Verdict verdict = apply(settings_, command.acoustics.value_or(Acoustics{}), device_);
    accepts_ |= verdict.refusal.empty();
    if (!verdict.refusal.empty() && refusals_.size() < notices_per_call) refusals_.push_back(verdict.refusal);
    changed_ = true;
  }
  void report_refusals(Reaction& reaction) {
    if (!accepts_)
      for (const std::string& refusal : refusals_) notice(reaction, "refused acoustic settings: " + refusal);
    accepts_ = false;
    refusals_.clear();
  }

  void on_salinity(const Command& command, Reaction& reaction) {
    const std::uint32_t salinity = command.salinity.value_or(Choice{}).value;  // an empty message is 0, fresh
    if (salinity != 0 && salinity != 15 && salinity != 35)
      return notice(reaction, "ignored a salinity of " + std::to_string(salinity));
    settings_.salinity = salinity;
    changed_ = true;
  }

  void on_focus(const Focus& wanted, Time now) {
    if (wanted.position != 0) return move_focus(std::min(wanted.position, 1000u), now);
    if (wanted.range_m > 0) move_focus(focus_position(static_cast<double>(wanted.range_m), product_of(*device_.model)), now);
  }
  void move_focus(std::uint32_t to, Time now) {
    settings_.focus_from = focus_at(settings_, now).position;
    settings_.focus_to = to;
    settings_.focus_set_at = now;
    changed_ = true;
  }

  void notice(Reaction& reaction, std::string text) {
    if (notices_++ < notices_per_call) reaction.events.emplace_back(Notice{std::move(text)});
  }

  const DeviceState& device_;
  std::shared_ptr<const VendorSettings> seen_;                 // the settings of the device at the last call
  std::deque<std::shared_ptr<const VendorSettings>> waiting_;  // settings that the device does not have yet, oldest first
  std::uint32_t first_ping_;
  bool streaming_ = false;             // true: this controller has set a receiver
  std::vector<std::string> refusals_;  // refusals of SET_ACOUSTICS since the last command of another type
  bool accepts_ = false;               // true: a SET_ACOUSTICS since then was accepted
  CommandFramer framer_;
  Settings settings_;  // the settings of base(), changed by the commands of this call
  bool changed_ = false;
  std::size_t notices_ = 0;
};

}  // namespace

std::unique_ptr<protocol::Dialogue> make_dialogue(const DeviceState& device) { return std::make_unique<ArisDialogue>(device); }

std::optional<Time> parse_date_time(const std::string& text) {
  constexpr std::string_view months = "JanFebMarAprMayJunJulAugSepOctNovDec";
  int year = 0, hour = 0, minute = 0, second = 0;
  unsigned day = 0;
  char month[4] = "";
  if (std::sscanf(text.c_str(), "%4d-%3[A-Za-z]-%2u %2d:%2d:%2d", &year, month, &day, &hour, &minute, &second) != 6) return {};
  const std::size_t at = months.find(month);
  const std::chrono::year_month_day date(std::chrono::year(year), std::chrono::month(static_cast<unsigned>(at / 3) + 1),
                                         std::chrono::day(day));
  const bool fits = at != std::string_view::npos && at % 3 == 0 && year >= 1970 && year < 2200 && date.ok();
  if (!fits || hour < 0 || hour > 23 || minute < 0 || minute > 59 || second < 0 || second > 60) return {};
  return Time(std::chrono::sys_days(date)) + std::chrono::hours(hour) + std::chrono::minutes(minute) +
         std::chrono::seconds(second);
}

}  // namespace sonar::aris
