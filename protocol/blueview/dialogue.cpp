#include <algorithm>
#include <deque>
#include <optional>

#include "protocol/blueview/blueview.hpp"
#include "protocol/blueview/frames.hpp"
#include "protocol/blueview/head_settings.hpp"

namespace sonar::blueview {
namespace {

using namespace std::chrono_literals;
using protocol::ChangeSettings;
using protocol::Close;
using protocol::DeviceState;
using protocol::Notice;
using protocol::Reaction;
using protocol::RequestPing;

// The link is sonard's own, so these values are chosen (docs/protocols/blueview-link.md).
constexpr auto keep_alive_after = 2s;  // time since the last message of the sonar
constexpr auto longest_host_silence = 10s;
constexpr std::size_t most_waiting = 8;  // PING requests of one host that may be unanswered at a time
constexpr std::uint32_t longest_wait_ms = 600000;
constexpr float housing_above_water_c = 2;  // unknown: housing temperature minus water temperature

/// A connection has one state, `greeted_`: before HELLO, all other requests are refused. After it, a host can get pings in two
/// ways at the same time: with PING requests, which wait in `waiting_` for a ping of their head and settings, and with one
/// subscription, which requests a ping per interval. All hosts share the settings, and the sonar computes one ping at a time, so
/// both ways only request a ping, and on_ping() determines which requests the ping answers.
class BlueViewDialogue final : public protocol::Dialogue {
 public:
  BlueViewDialogue(const DeviceState& device, Time now) : device_(device), spoke_at_(now) {}

  Reaction on_bytes(protocol::BytesView received, Time now) override {
    Reaction reaction;
    settings_ = settings_from(device_.settings.get(), device_);
    framer_.append(received);
    while (const auto frame = framer_.next()) {
      on_frame(*frame, now, reaction);
      // After a frame that closes the connection, later frames have no effect.
      if (!reaction.events.empty() && std::holds_alternative<Close>(reaction.events.back())) return reaction;
    }
    if (!framer_.broken().empty()) reaction.events.emplace_back(Close{framer_.broken()});
    if (!reaction.replies.empty()) spoke_at_ = now;
    return reaction;
  }

  Reaction on_tick(Time now, bool ping_pending) override {
    Reaction reaction;
    settings_ = settings_from(device_.settings.get(), device_);
    // on_ping_request() keeps the deadlines in order, so the first entry expires first.
    while (!waiting_.empty() && waiting_.front().until <= now) {
      reaction.replies.push_back(make_error(waiting_.front().request_id, Code::timeout, "no ping in the time given"));
      waiting_.pop_front();
    }
    if (subscription_ && subscription_->next <= now) {
      subscription_->wanted = true;
      // A pending PING request for another head has priority, because otherwise a subscription with a short interval would delay
      // it forever.
      if (!ping_pending || settings_.active_head == subscription_->head) ask_for_ping(subscription_->head, reaction);
      // Intervals that have passed are skipped, so that a late tick requests only one ping.
      subscription_->next += ((now - subscription_->next) / subscription_->interval + 1) * subscription_->interval;
    }
    if (now >= spoke_at_ + keep_alive_after) reaction.replies.push_back(make_frame(FrameType::keep_alive, 0, {}));
    if (!reaction.replies.empty()) spoke_at_ = now;
    return reaction;
  }

  Time next_tick() const override {
    Time next = spoke_at_ + keep_alive_after;
    for (const Waiting& w : waiting_) next = std::min(next, w.until);
    if (subscription_) next = std::min(next, subscription_->next);
    return next;
  }

  std::optional<Time> next_ping_request() const override {
    return subscription_ ? std::optional(subscription_->next) : std::nullopt;
  }
  std::optional<std::chrono::milliseconds> longest_silence() const override { return longest_host_silence; }

  void on_ping_queued(Time now) override { spoke_at_ = now; }

  protocol::Delivery on_ping(const VendorSettings* made_with, std::size_t shared_bytes, Time now) override {
    protocol::Delivery delivery;
    const SonarSettings fired_with = settings_from(made_with, device_);
    const int head = fired_with.active_head;
    const HeadSettings& fired = fired_with.heads[static_cast<std::size_t>(head)];
    const HeadSettings now_set = settings_from(device_.settings.get(), device_).heads[static_cast<std::size_t>(head)];
    for (auto it = waiting_.begin(); it != waiting_.end();) {
      // A ping that was fired before a SET does not answer a PING request that came after the SET, because the settings of the
      // ping differ from those at the request and from the present ones.
      if (it->head != head || (fired != it->asked_with && fired != now_set)) {
        ++it;
        continue;
      }
      delivery.prefixes.push_back(make_header(FrameType::ping_data, it->request_id, shared_bytes));
      it = waiting_.erase(it);
    }
    if (subscription_ && subscription_->wanted && subscription_->head == head) {
      delivery.prefixes.push_back(make_header(FrameType::ping_data, 0, shared_bytes));
      subscription_->wanted = false;
    }
    const bool subscriber_waits = subscription_ && subscription_->wanted;
    if (!waiting_.empty() || subscriber_waits) {  // other requests need another head or other settings; request their ping next
      Reaction reaction;
      settings_ = settings_from(device_.settings.get(), device_);
      ask_for_ping(waiting_.empty() ? subscription_->head : waiting_.front().head, reaction);
      delivery.events = std::move(reaction.events);
    }
    if (!delivery.prefixes.empty()) on_ping_queued(now);
    return delivery;
  }

 private:
  /// A PING request that has not been answered. `asked_with`: the settings of the head at the request.
  struct Waiting {
    std::uint32_t request_id = 0;
    int head = 0;
    Time until{};
    HeadSettings asked_with;
  };
  /// A subscription. `wanted`: true if the ping of the present interval was requested but not sent yet.
  struct Subscription {
    int head = 0;
    std::chrono::milliseconds interval{0};
    Time next{};
    bool wanted = false;
  };

  int base() const { return text_option(device_.options, option_name::heads_base) == "1" ? 1 : 0; }

  /// Returns the index of the head with the host's number `id`. Hosts number heads from 0 or from 1; if there is one head, both
  /// numbers mean that head, unless heads_base is strict.
  std::optional<int> head_of(std::int32_t id) const {
    const int count = static_cast<int>(settings_.heads.size());
    const int index = id - base();
    if (index >= 0 && index < count) return index;
    const bool alias = text_option(device_.options, option_name::heads_base) != "strict" && count == 1 && (id == 0 || id == 1);
    return alias ? std::optional<int>(0) : std::nullopt;
  }

  /// Handles a frame. Before a HELLO of version 1 only HELLO and KEEPALIVE are accepted; other requests get error 14004.
  void on_frame(const Frame& frame, Time now, Reaction& reaction) {
    wire::Reader reader(frame.payload);
    switch (frame.header.type) {
      case FrameType::hello:
        return on_hello(frame, reader, reaction);
      case FrameType::keep_alive:
        return;
      case FrameType::set:
      case FrameType::get:
      case FrameType::ping:
      case FrameType::subscribe:
        break;
      default:
        return refuse(frame, Code::bad_packet_type, "unknown frame type " + std::to_string(static_cast<int>(frame.header.type)),
                      reaction);
    }
    if (!greeted_) return refuse(frame, Code::bad_packet_version, "a HELLO must be sent first", reaction);
    std::int32_t id = 0;
    reader("head", id);
    const auto head = head_of(id);
    if (reader.ok() && !head) return refuse(frame, Code::no_head, "no head " + std::to_string(id), reaction);
    if (head) on_head_frame(frame, *head, reader, now, reaction);
    // If the frame is too short, the handler returns without a reply, and the frame is refused here.
    if (!reader.ok()) refuse(frame, Code::bad_parameter, reader.failure_text(), reaction);
  }

  void on_head_frame(const Frame& frame, int head, wire::Reader& reader, Time now, Reaction& reaction) {
    switch (frame.header.type) {
      case FrameType::set:
        return on_set(frame, head, reader, reaction);
      case FrameType::get:
        return on_get(frame, head, reader, reaction);
      case FrameType::ping:
        return on_ping_request(frame, head, reader, now, reaction);
      default:
        return on_subscribe(frame, head, reader, now, reaction);
    }
  }

  void refuse(const Frame& frame, Code code, const std::string& text, Reaction& reaction) {
    reaction.replies.push_back(make_error(frame.header.request_id, code, text));
    if (reaction.events.size() < 8) reaction.events.emplace_back(Notice{"refused a host's request: " + text});
  }

  void on_hello(const Frame& frame, wire::Reader& reader, Reaction& reaction) {
    std::uint16_t version = 0, abi = 0;
    reader("proto", version);
    reader("abi", abi);
    read_text(reader, "client");
    if (!reader.ok()) return refuse(frame, Code::bad_parameter, reader.failure_text(), reaction);
    if (version != protocol_version) {
      refuse(frame, Code::bad_packet_version,
             "version " + std::to_string(version) + " of the link is not supported, only version 1", reaction);
      reaction.events.emplace_back(Close{"uses another version of the link"});
      return;
    }
    greeted_ = true;
    reaction.replies.push_back(make_frame(reply_to(FrameType::hello), frame.header.request_id, hello_payload()));
  }

  /// Describes the sonar and all heads, so that the drop-in libraries can execute the SDK's queries without a request.
  wire::Bytes hello_payload() const {
    wire::Bytes out;
    const Put write(out);
    write("proto", protocol_version);
    put_text(out, device_.model->name);
    put_text(out, settings_.name);
    put_text(out, std::to_string(device_.id));
    put_text(out, "sonard");
    write("temp_c", static_cast<float>(device_.water.temperature_c) + housing_above_water_c);
    const std::uint32_t strict_heads = text_option(device_.options, option_name::heads_base) == "strict" ? 1 : 0;
    write("caps", strict_heads | (device_.simulated_time ? 2u : 0u));
    write("n_heads", static_cast<std::uint8_t>(settings_.heads.size()));
    for (std::size_t i = 0; i < settings_.heads.size(); ++i) put_head(out, static_cast<int>(i));
    return out;
  }

  void put_head(wire::Bytes& out, int index) const {
    const HeadSettings& head = settings_.heads[static_cast<std::size_t>(index)];
    const FrequencyMode& mode = device_.model->modes[static_cast<std::size_t>(index)];
    SonarSettings of_this_head = settings_;
    of_this_head.active_head = index;
    const float half_deg = static_cast<float>(0.5 * deg_from_rad(static_cast<double>(mode.horizontal_aperture_rad)));
    const Put write(out);
    write("id", static_cast<std::int32_t>(index + base()));
    put_text(out, settings_.heads.size() == 1 ? "Head" : "Head " + mode.name);
    write("min", mode.min_range_m);
    write("max", mode.max_range_m);
    write("start", head.start_m);
    write("stop", head.stop_m);
    write("centre_hz", static_cast<std::int32_t>(mode.centre_hz));
    write("fov_min", -half_deg);
    write("fov_max", half_deg);
    write("beams", static_cast<std::uint16_t>(ping_settings(of_this_head, device_).beam_count));
    write("sound_speed", head.sound_speed_mps);
    write("gain", head.gain_db);
    write("tvg", head.tvg_db_per_m);
    write("fluid", head.fluid);
  }

  void on_set(const Frame& frame, int head, wire::Reader& reader, Reaction& reaction) {
    Key key{};
    reader("key", key);
    const auto value = read_value(reader, key);
    if (!value) return reader.ok() ? refuse(frame, Code::bad_parameter, "unknown kind of value", reaction) : void();
    const Applied applied = apply(settings_, head, key, *value, device_);
    if (!applied.value) return refuse(frame, applied.refusal.code, applied.refusal.text, reaction);
    wire::Bytes payload;
    put_value(payload, *applied.value);
    reaction.replies.push_back(make_frame(reply_to(FrameType::set), frame.header.request_id, payload));
    reaction.events.emplace_back(change());
  }

  void on_get(const Frame& frame, int head, wire::Reader& reader, Reaction& reaction) {
    Key key{};
    reader("key", key);
    if (!reader.ok()) return;
    const auto value = read_back(settings_, head, key);
    if (!value) return refuse(frame, Code::bad_parameter, "unknown key " + std::to_string(static_cast<int>(key)), reaction);
    wire::Bytes payload;
    put_value(payload, *value);
    reaction.replies.push_back(make_frame(reply_to(FrameType::get), frame.header.request_id, payload));
  }

  /// Puts a PING request into `waiting_`. on_ping() answers it or, when its time is over, on_tick() with error 18.
  void on_ping_request(const Frame& frame, int head, wire::Reader& reader, Time now, Reaction& reaction) {
    std::uint32_t timeout_ms = 0;
    reader("timeout_ms", timeout_ms);
    if (!reader.ok()) return;
    if (waiting_.size() >= most_waiting)
      return refuse(frame, Code::bad_parameter, "8 requests of this host wait for their pings already", reaction);
    const std::chrono::milliseconds wait(std::min(timeout_ms == 0 ? longest_wait_ms : timeout_ms, longest_wait_ms));
    Time until = now + wait;
    if (!waiting_.empty()) until = std::max(until, waiting_.back().until);  // answers are sent in the order of the requests
    waiting_.push_back({frame.header.request_id, head, until, settings_.heads[static_cast<std::size_t>(head)]});
    ask_for_ping(head, reaction);
  }

  /// Sets the only subscription of a host; interval 0 ends it.
  void on_subscribe(const Frame& frame, int head, wire::Reader& reader, Time now, Reaction& reaction) {
    std::uint32_t interval_ms = 0;
    reader("interval_ms", interval_ms);
    if (!reader.ok()) return;
    subscription_.reset();
    if (interval_ms > 0) {
      const std::uint32_t held = std::clamp(interval_ms, 10u, longest_wait_ms);
      subscription_ = Subscription{head, std::chrono::milliseconds(held), now, false};
    }
    reaction.replies.push_back(make_frame(reply_to(FrameType::subscribe), frame.header.request_id, {}));
  }

  /// Requests a ping of a head. First makes the head active, because the device pings with the active head. A ping of that head
  /// that is already being computed with these settings also serves the request (`joins`).
  void ask_for_ping(int head, Reaction& reaction) {
    settings_.active_head = head;
    reaction.events.emplace_back(change());
    reaction.events.emplace_back(RequestPing{.joins = true});
  }

  ChangeSettings change() const {
    return {ping_settings(settings_, device_), std::make_shared<SonarSettings>(settings_), describe(settings_, device_)};
  }

  const DeviceState& device_;
  Framer framer_;
  SonarSettings settings_;  // the device's settings, read at the start of each call and changed by the call
  bool greeted_ = false;
  std::deque<Waiting> waiting_;  // oldest first
  std::optional<Subscription> subscription_;
  Time spoke_at_;
};

}  // namespace

std::unique_ptr<protocol::Dialogue> make_dialogue(const DeviceState& device, Time now) {
  return std::make_unique<BlueViewDialogue>(device, now);
}

// Other datagrams get no answer. The answer is longer than the request, but only by the names of the model and the sonar.
protocol::Bytes answer_discovery(protocol::BytesView datagram, const DeviceState& device) {
  std::array<std::uint8_t, 4> letters{};
  std::uint16_t version = 0;
  wire::Reader reader(datagram);
  reader("letters", letters);
  reader("version", version);
  if (!reader.ok() || letters != discovery_question || version != protocol_version) return {};
  protocol::Bytes answer;
  const Put write(answer);
  write("letters", discovery_answer);
  write("version", protocol_version);
  write("tcp_port", tcp_port);
  put_text(answer, device.model->name);
  put_text(answer, std::to_string(device.id));
  return answer;
}

}  // namespace sonar::blueview
