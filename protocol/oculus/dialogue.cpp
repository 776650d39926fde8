#include <algorithm>
#include <cstdio>
#include <optional>

#include "protocol/oculus/encode_ping.hpp"
#include "protocol/oculus/framer.hpp"
#include "protocol/oculus/oculus.hpp"
#include "protocol/oculus/settings.hpp"

namespace sonar::oculus {
namespace {

using protocol::ChangeSettings;
using protocol::DeviceState;
using protocol::Notice;
using protocol::Reaction;
using protocol::RequestPing;
using protocol::StoreAddress;

constexpr std::size_t notices_per_call = 8;               // bounds the log output that a hostile client can cause
constexpr auto greeting_after = std::chrono::seconds(2);  // known drivers send their first fire message within a second

/// The dialogue with one client (docs/protocols/oculus.md, section 1), which has three states:
/// - Before the first valid fire message the device sends a dummy whenever it has sent nothing for a period. By default (option
///   boot_text) a client that sends no fire message gets the log text of section 6.1.
/// - While the device pings it sends no dummy, however long a ping takes. With network trigger it sends dummies while no ping
///   is requested.
/// - In standby (ping rate 5) it sends a dummy at once, then one after each period of silence.
class OculusDialogue final : public protocol::Dialogue {
 public:
  OculusDialogue(const DeviceState& device, Time now) : device_(device) {
    postpone_dummy(now);
    const std::string_view boot_text = text_option(device.options, option_name::boot_text);
    greets_silent_ = boot_text == "if_silent";
    if (greets_silent_) greeting_at_ = now + greeting_after;
    if (boot_text == "on") greeting_at_ = now;
  }

  Reaction on_bytes(protocol::BytesView received, Time now) override {
    Reaction reaction;
    notices_ = 0;
    // The daemon carries out the events of this call after the call has returned. So `stored_` keeps the address of a write
    // request for a read request that follows it in the same call.
    stored_ = device_.stored_address;
    const std::uint64_t skipped_before = framer_.skipped_bytes();
    framer_.append(received);
    while (const auto message = framer_.next()) on_message(*message, now, reaction);
    if (const std::uint64_t skipped = framer_.skipped_bytes() - skipped_before; skipped > 0)
      notice(reaction, "skipped " + std::to_string(skipped) + " bytes that start no Oculus message");
    return reaction;
  }

  Reaction on_tick(Time now, bool) override {
    Reaction reaction;
    if (now < next_tick()) return reaction;
    if (greeting_at_ && now >= *greeting_at_) {
      reaction.replies.push_back(make_log(device_.id, "sonard: emulated " + device_.model->name + "\n"));
      greeting_at_.reset();
    } else {
      reaction.replies.push_back(make_dummy(device_.id));
    }
    postpone_dummy(now);
    return reaction;
  }

  Time next_tick() const override {
    const Time dummy_at = expects_pings() ? Time::max() : dummy_at_;
    return greeting_at_ ? std::min(*greeting_at_, dummy_at) : dummy_at;
  }
  void on_ping_queued(Time now) override {
    is_not_waiting();
    // The result is kept, because another client may replace the settings that this client sent.
    is_heard_ = is_heard();
    requested_ping_ = false;
    postpone_dummy(now);
  }

 private:
  void on_message(wire::BytesView message, Time now, Reaction& reaction) {
    const MessageHeader header = header_of(message);
    switch (header.type) {
      case MessageType::fire:
        return on_fire(message, now, reaction);
      case MessageType::user_config:
        return on_user_config(message, now, reaction);
      case MessageType::dummy:
        return;
      default:
        break;
    }
    char text[80];
    std::snprintf(text, sizeof text, "ignored a message of unexpected type 0x%04X (%zu bytes)",
                  static_cast<unsigned>(header.type), message.size());
    notice(reaction, text);
  }

  void on_fire(wire::BytesView message, Time now, Reaction& reaction) {
    is_not_waiting();
    const auto fire = parse_fire(message);
    if (!fire) return notice(reaction, "ignored a fire message of " + std::to_string(message.size()) + " bytes, 53 are needed");
    if (has_non_finite(fire->settings))
      return notice(reaction, "ignored a fire message whose range, gain, sound speed or salinity is not a finite number");
    ResolvedSettings resolved = resolve(*fire, device_);
    if (!resolved.clamped.empty() && text_option(device_.options, option_name::out_of_range) == "ignore")
      return notice(reaction, "ignored a fire message: " + resolved.clamped.front() + " (option out_of_range: ignore)");

    const protocol::Bytes request = make_fire(*fire);
    const bool standby = resolved.settings.rate_hz <= 0;
    const bool repeated = request == last_request_;
    last_request_ = request;
    const bool one_ping = resolved.settings.triggered && !standby;
    // is_heard() compares fired_ with the settings of the device, so it is called before fired_ is replaced.
    is_heard_ = is_heard();
    fired_ = std::make_shared<HeldFire>(*fire);
    reaction.events.emplace_back(ChangeSettings{resolved.settings, fired_, summary(*fire, resolved)});
    if (one_ping) reaction.events.emplace_back(RequestPing{});
    requested_ping_ = one_ping;
    // Drivers interpret a dummy as the acknowledgement of standby (ENS). Some repeat a fire message for every ping (VND) or ten
    // times a second (MRG); a repeated standby is applied again but not acknowledged again, or dummies would flood the client.
    if (standby && !repeated) {
      reaction.replies.push_back(make_dummy(device_.id));
      postpone_dummy(now);
    }
  }

  /// True if the client waits for pings. It then gets no dummy, however long a ping takes, because ENSTA's driver interprets a
  /// dummy as the acknowledgement of standby, and then stores standby as its ping rate. With network trigger the device waits for
  /// the client, so dummies are sent. An observer's fire messages never become the settings of the device, so an observer does
  /// not count as waiting.
  bool expects_pings() const {
    const auto* held = dynamic_cast<const HeldFire*>(device_.settings.get());
    if (!is_heard() || held == nullptr || table_rate_hz(held->fire.settings.ping_rate) <= 0) return false;
    return requested_ping_ || (held->fire.settings.flags & flag::network_trigger) == 0;
  }

  /// True if the device uses settings of this client or has used them.
  bool is_heard() const { return is_heard_ || (fired_ != nullptr && device_.settings == fired_); }

  static std::string summary(const FireRequest& fire, const ResolvedSettings& resolved) {
    std::string text = describe(fire);
    for (const std::string& clamped : resolved.clamped) text += "; " + clamped;
    return text;
  }

  void on_user_config(wire::BytesView message, Time now, Reaction& reaction) {
    UserConfigMessage config;
    wire::Reader reader(message);
    fields(reader, config);
    if (!reader.ok()) return notice(reaction, "ignored a user configuration: " + reader.failure_text());
    const bool write = config.ip_address != 0;  // address 0 reads
    if (write) {
      stored_ = {config.ip_address, config.ip_mask, config.dhcp_enable != 0};
      reaction.events.emplace_back(StoreAddress{stored_});
    }
    // By default a write is not answered, because the vendor's viewer reads the values afterwards.
    if (write && text_option(device_.options, option_name::user_config_write) != "reply") return;
    reaction.replies.push_back(make_user_config(device_.id, stored_, device_));
    postpone_dummy(now);  // VND reads the first 28 bytes after its request as the reply, so no dummy may precede the reply
  }

  void notice(Reaction& reaction, std::string text) {
    if (notices_++ < notices_per_call) reaction.events.emplace_back(Notice{std::move(text)});
  }

  void is_not_waiting() {
    if (greets_silent_) greeting_at_.reset();
  }

  void postpone_dummy(Time now) {
    const double period_ms = number_option(device_.options, option_name::dummy_period_ms);
    dummy_at_ = now + nanoseconds_from(period_ms * 1e-3);
  }

  const DeviceState& device_;
  Framer framer_{Sender::client};
  protocol::Bytes last_request_;
  protocol::StoredAddress stored_;  // copied from the device at each call, then changed by writes in that call
  Time dummy_at_{};
  std::shared_ptr<const VendorSettings> fired_;  // settings of the last fire message
  bool is_heard_ = false;                        // true: the device has used settings of this client
  bool requested_ping_ = false;                  // true: a network trigger requested a ping that is not sent yet
  std::optional<Time> greeting_at_;
  bool greets_silent_ = false;  // boot_text is if_silent: a fire message, or a ping to the client, cancels the greeting
  std::size_t notices_ = 0;
};

}  // namespace

std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, Time now) {
  return std::make_unique<OculusDialogue>(device, now);
}

}  // namespace sonar::oculus
