#include <algorithm>
#include <utility>

#include "protocol/awaited_ping.hpp"
#include "protocol/micron/micron.hpp"
#include "protocol/micron/settings.hpp"

namespace sonar::micron {
namespace {

using protocol::Reaction;

constexpr auto alive_period = std::chrono::seconds(1);
constexpr auto boot_time = std::chrono::seconds(2);  // unknown; assumed, because hosts wait 2.5 s before they read
constexpr int recentring_alives = 2;                 // mtAlive messages before the head is centred: 5D, 4D, then 4A (ENS)
constexpr std::size_t user_size = 250, calibration_size = 66, fpga_version_size = 14;  // sizes of the payloads; ROCK, ENS
constexpr std::size_t notices_per_call = 8;  // bounds the log output that a hostile host can cause

/// The dialogue with one host (docs/protocols/micron.md, "Session"):
/// - After power-up or a reboot the head has no parameters: it sends mtAlive once per second and ignores requests for scan lines.
/// - mtHeadCommand sets the parameters. The next mtAlive reports that they were received, and the one after it reports that they
///   are valid.
/// - mtSendData requests one or two scan lines (`wanted_`). For each line a ping is requested when the head has turned
///   (`arrives_`), and is awaited (`awaited_`). Then the head turns by a step. mtAlive pauses meanwhile.
/// The protocol has no refusal, so invalid messages are logged and ignored.
class MicronDialogue final : public protocol::Dialogue {
 public:
  MicronDialogue(const protocol::DeviceState& device, Time now)
      : device_(device), next_alive_(now + alive_period), arrives_(now), knows_parameters_(settings().has_parameters) {
    if (knows_parameters_) arrives_ += turning(scan_.begin(settings().command));
  }

  Reaction on_bytes(BytesView received, Time now) override {
    Reaction reaction;
    splitter_.append(now, received);
    while (const auto whole = splitter_.next()) {
      if (now < boots_until_) continue;  // while it restarts, the head ignores all messages
      if (const auto message = read_frame(whole->bytes))
        on_message(*message, now, reaction);
      else
        notice(std::to_string(whole->bytes.size()) + " bytes that are not a message", reaction);
    }
    return reaction;
  }

  Reaction on_tick(Time now, bool ping_pending) override {
    Reaction reaction;
    if (now >= alive_tick()) {
      reaction.replies.push_back(alive(now));
      next_alive_ = now + alive_period;
    }
    if (now < ping_tick()) return reaction;
    if (awaited_.is_under_way()) {
      if (awaited_.lose(ping_pending, now)) advance(now);
      return reaction;
    }
    Settings s = settings();
    s.bearing = static_cast<std::uint16_t>(scan_.bearing);
    const auto with = std::make_shared<const HeldSettings>(s);
    awaited_.begin(with, now);
    reaction.events.emplace_back(protocol::RequestPing{.joins = false, .head_rad = head_rad(s), .with = with});
    return reaction;
  }
  Time next_tick() const override { return std::min(alive_tick(), ping_tick()); }
  std::optional<Time> next_ping_request() const override {
    return wanted_ > 0 && !awaited_.is_under_way() ? std::optional(ping_tick()) : std::nullopt;
  }
  void on_ping_queued(Time) override {}
  protocol::Delivery on_ping(const VendorSettings* made_with, std::size_t, Time now) override {
    const auto arrival = awaited_.arrive(made_with);
    if (arrival == protocol::AwaitedPing::Arrival::other) return {};
    if (arrival == protocol::AwaitedPing::Arrival::awaited) advance(now);
    return {{Bytes{}}, {}};
  }

 private:
  void on_message(const Message& message, Time now, Reaction& reaction) {
    switch (message.header.id) {
      case Id::send_version: {
        const VersionData version{.software = 1, .serial = device_.id};
        reaction.replies.push_back(from_head(Id::version_data, wire::bytes_of(version)));
        return;
      }
      case Id::send_user:  // ENS waits for all three answers
        reaction.replies.push_back(from_head(Id::user_data, Bytes(user_size)));
        reaction.replies.push_back(from_head(Id::fpga_calibration_data, Bytes(calibration_size)));
        reaction.replies.push_back(from_head(Id::fpga_version_data, Bytes(fpga_version_size)));
        return;
      case Id::reboot:
        return reboot(now, reaction);
      case Id::head_command:
        return on_command(message.payload, now, reaction);
      case Id::send_data: {
        if (!settings_after(reaction).has_parameters) return notice("it has no parameters: send mtHeadCommand first", reaction);
        const int lines = protocol::text_option(device_.options, option_name::lines) == "2" ? 2 : 1;
        // At most two requests wait: a driver that repeats its request after a time-out must not get more and more lines.
        wanted_ = std::min(wanted_ + lines, 2 * lines);
        stops_alives_ = false;
        return;
      }
      case Id::stop_alives:
        stops_alives_ = true;
        return;
      default:
        notice("unknown message " + std::to_string(static_cast<int>(message.header.id)), reaction);
    }
  }

  void on_command(BytesView payload, Time now, Reaction& reaction) {
    Settings s = settings_after(reaction);
    if (payload.size() == 1 && payload.front() == std::byte{reverse_command}) {  // MCG: reverses the scan
      scan_.to_right = !scan_.to_right;
      return;
    }
    const auto command = read_front<HeadCommand>(payload);
    if (!command || (command->kind != whole_command && command->kind != long_command))
      return notice("mtHeadCommand of another kind", reaction);
    if (const std::string why = complaint(*command); !why.empty()) return notice("ignored mtHeadCommand: " + why, reaction);
    s.command = *command;
    s.has_parameters = true;
    forget_pings();
    const int way = scan_.begin(s.command);
    arrives_ = std::max(arrives_, now) + turning(way);
    reaction.events.emplace_back(change_to(s, device_));
  }

  void reboot(Time now, Reaction& reaction) {
    forget_pings();
    scan_ = {};
    boots_until_ = now + boot_time;
    recentring_ = recentring_alives;
    next_alive_ = arrives_ = boots_until_;
    knows_parameters_ = stops_alives_ = false;
    reaction.events.emplace_back(change_to(Settings{}, device_));
  }

  Bytes alive(Time now) {
    const Settings s = settings();
    using namespace head_info;
    const bool centred = recentring_ == 0;
    std::uint8_t info = motor_on | (centred ? head_info::centred : static_cast<std::uint8_t>(recentring | motoring));
    if (recentring_ == recentring_alives || (s.has_parameters && scan_.to_right)) info |= to_right;
    // ENS waits for two messages: the first mtAlive with parameters still has the bit no_parameters, the second does not.
    if (!s.has_parameters || !knows_parameters_) info |= no_parameters;
    if (s.has_parameters) info |= received_parameters;
    knows_parameters_ = s.has_parameters;
    recentring_ = std::max(recentring_ - 1, 0);
    constexpr auto day = std::chrono::hours(24);
    const auto of_day = std::chrono::duration_cast<std::chrono::milliseconds>((now + device_.skipped).time_since_epoch() % day);
    const Alive message{.lacks_parameters = static_cast<std::uint8_t>((info & no_parameters) != 0 ? 0x80 : 0),
                        .time_ms = static_cast<std::uint32_t>(of_day.count()),
                        .bearing = static_cast<std::uint16_t>(scan_.bearing),
                        .head_info = info};
    return from_head(Id::alive, wire::bytes_of(message));
  }

  /// Ends the ping that was awaited. The head turns further after the samples have been taken and the line has been sent, so a
  /// slow link (option link_rate) limits the rate of the scan.
  void advance(Time now) {
    --wanted_;
    next_alive_ = now + alive_period;
    const HeadCommand command = settings().command;
    const auto after = listening(command) + transfer(command, device_.options);
    // After a late ping the scan does not catch up; the next ping is due now at the earliest.
    arrives_ = std::max(awaited_.fired_at() + after + turning(scan_.advance(command)), now);
  }
  void forget_pings() {
    wanted_ = 0;
    awaited_.forget();
  }

  Settings settings() const { return settings_from(device_.settings.get()); }
  /// Returns the settings after the changes of this call, which the daemon has not made yet.
  Settings settings_after(const Reaction& reaction) const {
    return settings_from(protocol::settings_after(reaction, device_.settings.get()));
  }
  /// Returns the time of the next mtAlive. unknown: that none is sent while lines are requested; assumed, because drivers then
  /// expect only scan lines.
  Time alive_tick() const { return stops_alives_ || wanted_ > 0 ? Time::max() : next_alive_; }
  Time ping_tick() const {
    if (wanted_ == 0) return Time::max();
    return awaited_.is_under_way() ? awaited_.lost_at() : arrives_;
  }
  static void notice(std::string text, Reaction& reaction) {
    if (reaction.events.size() < notices_per_call) reaction.events.emplace_back(protocol::Notice{std::move(text)});
  }

  const protocol::DeviceState& device_;
  recording::MessageSplitter splitter_{recording::Origin::client, framing};
  Time next_alive_{}, boots_until_{};
  bool stops_alives_ = false;  // true: a host has sent mtStopAlives, and has not requested lines since
  int recentring_ = 0;         // number of mtAlive messages that still have to report the return of the head to its centre
  Scan scan_;                  // the bearing that the head has, or to which it turns
  Time arrives_{};             // time at which the head has that bearing
  bool knows_parameters_;      // true: an mtAlive has reported that parameters were received
  int wanted_ = 0;             // scan lines that were requested and not sent yet
  protocol::AwaitedPing awaited_;
};

}  // namespace

std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, Time now) {
  return std::make_unique<MicronDialogue>(device, now);
}

}  // namespace sonar::micron
