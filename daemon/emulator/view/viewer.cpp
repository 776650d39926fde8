#include "daemon/emulator/view/viewer.hpp"

#include <algorithm>

namespace sonar {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double messages_per_s = 100, burst = 200;
constexpr int most_complaints = 10;
constexpr std::size_t most_passing = 64, longest_name_said = 256;
constexpr milliseconds between_times{33};
constexpr seconds slow_is_said_for{5}, refusal_is_shown_for{10};
// Viewers recognise exactly this text and show a hint.
constexpr const char* too_slow = "Send buffer limit reached";
constexpr const char* slow_id = "slow";

Viewer::Moment interval_of(double hz) { return hz > 0 ? Viewer::Moment(nanoseconds_from(1 / hz)) : Viewer::Moment{0}; }

}  // namespace

wire::Bytes Viewer::bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
  return {bytes.begin(), bytes.end()};
}

// ---- from the socket

void Viewer::on_text(std::string_view text, Moment now) {
  if (!has_room_for_message(now)) return;
  std::string stray;
  const auto word = foxglove::word_of_viewer(text, &stray);
  if (!word) return complain(word.error().text);
  const bool is_read =
      !std::holds_alternative<foxglove::UnknownWord>(*word) && !std::holds_alternative<foxglove::Incapable>(*word);
  if (is_read && !stray.empty()) warn_ignored("fields such as \"" + stray + "\" are ignored");
  std::visit([&](const auto& said) { on_word(said, now); }, *word);
}

void Viewer::on_binary(wire::BytesView frame, Moment now) {
  if (!has_room_for_message(now)) return;
  const auto read = foxglove::frame_of_viewer(frame);
  if (!read) return complain(read.error().text);
  if (const auto* playback = std::get_if<foxglove::PlaybackControl>(&*read)) {
    if (!host_.steer_playback(*this, *playback)) complain("playbackControl is not among the capabilities of this connection");
    return;
  }
  const auto* call = std::get_if<foxglove::ServiceCall>(&*read);
  ++open_calls_;
  if (!rights_.may_steer) return fail(*call, read_only);
  if (open_calls_ > most_calls) return fail(*call, "4 calls are open already");
  if (call->encoding != "json") return fail(*call, "the encoding of services is json");
  host_.call(*this, *call);
}

/// False if the viewer has sent more than 100 messages per second (token bucket); it is then disconnected.
bool Viewer::has_room_for_message(Moment now) {
  if (allowance_at_) allowance_ = std::min(burst, allowance_ + messages_per_s * sonar::seconds(now - *allowance_at_));
  allowance_at_ = now;
  if (allowance_ < 1) close_ = CloseCode::policy;
  allowance_ -= 1;
  return close_ == CloseCode::none;
}

/// Reports an unreadable message; a viewer with too many of them is disconnected.
void Viewer::complain(const std::string& why) {
  send_status(foxglove::StatusLevel::error, why);
  if (++complaints_ >= most_complaints) close_ = CloseCode::policy;
}

// Each subscription has a slot for waiting messages: a queue of limited length for events; one message, the newest, for other
// channels.
void Viewer::on_word(const foxglove::Subscribe& word, Moment) {
  for (const auto& [id, channel] : word.subscriptions) {
    const ViewChannel* const offered = host_.channel(channel);
    if (offered == nullptr) {
      send_status(foxglove::StatusLevel::error, "there is no channel " + std::to_string(channel));
    } else if (slots_.contains(id) || subscribes(channel)) {
      send_status(foxglove::StatusLevel::warning,
                  "subscription " + std::to_string(id) + " to channel " + std::to_string(channel) + " exists already; ignored");
    } else if (slots_.size() >= most_subscriptions) {
      send_status(foxglove::StatusLevel::error, "more than 256 subscriptions");
    } else {
      const Moment own = offered->kind == ViewChannel::Kind::picture ? interval_of(rights_.most_hz) : Moment{0};
      slots_[id] = {channel, offered->kind, std::max(interval_of(offered->most_hz), own), offered->deepest, {}, {}};
      dropped_[channel];  // creates the entry 0, so that the channel is listed
      host_.on_subscribed(*this, channel);
    }
  }
}

void Viewer::on_word(const foxglove::Unsubscribe& word, Moment) {
  for (const std::uint32_t id : word.subscriptions)
    if (slots_.erase(id) == 0) send_status(foxglove::StatusLevel::warning, "there is no subscription " + std::to_string(id));
}

void Viewer::on_word(const foxglove::GetParameters& word, Moment) {
  say(foxglove::parameter_values(host_.parameters(*this, word.names), word.request));
}

/// Sets parameters, and answers with the resulting values.
void Viewer::on_word(const foxglove::SetParameters& word, Moment now) {
  std::vector<std::string> names;
  for (const foxglove::Parameter& wanted : word.parameters) {
    names.push_back(wanted.name);
    const std::string why = rights_.may_steer ? host_.set_parameter(*this, wanted) : read_only;
    const std::string name = wanted.name.substr(0, longest_name_said);
    if (!why.empty()) show_for_now(name + ": " + why, "param:" + name, now, refusal_is_shown_for);
    if (!rights_.may_steer) break;  // one error is enough
  }
  if (!names.empty()) say(foxglove::parameter_values(host_.parameters(*this, names), word.request));
}

void Viewer::on_word(const foxglove::WatchParameters& word, Moment) {
  if (word.names.empty()) {
    watches_all_ = word.on;
    watched_.clear();
  }
  for (const std::string& name : word.names) {
    if (!word.on)
      watched_.erase(name);
    else if (watched_.size() < most_subscriptions)
      watched_.insert(name);
  }
}

void Viewer::on_word(const foxglove::Incapable& word, Moment) {
  send_status(foxglove::StatusLevel::error,
              word.op + " needs the capability " + word.capability + ", which sonard does not have");
}

void Viewer::on_word(const foxglove::UnknownWord& word, Moment) {
  warn_ignored("operations such as \"" + word.op + "\" are ignored");
}

/// Warns once per connection.
void Viewer::warn_ignored(const std::string& what) {
  if (!std::exchange(warned_unknown_, true)) send_status(foxglove::StatusLevel::warning, what);
}

// ---- from the host

void Viewer::say(std::string word) { add_word({true, bytes_of(word), {}}); }
void Viewer::say_frame(wire::Bytes frame) { add_word({false, std::move(frame), {}}); }

/// Queues a JSON text. These texts are never dropped; a viewer that is too slow for them is disconnected, and may connect again.
void Viewer::add_word(ViewMessage word) {
  word_bytes_ += word.head.size();
  words_.push_back(std::move(word));
  if (words_.size() > most_words || word_bytes_ > most_word_bytes) close_ = CloseCode::try_again_later;
}

/// Shows a status that next() removes after `lasts`. If 64 such statuses exist already, the new status is not removed.
void Viewer::show_for_now(const std::string& text, const std::string& id, Moment now, Moment lasts) {
  if (passing_.size() >= most_passing && !passing_.contains(id)) return send_status(foxglove::StatusLevel::error, text);
  send_status(foxglove::StatusLevel::error, text, id);
  passing_[id] = now + lasts;
}

bool Viewer::subscribes(std::uint32_t channel) const {
  return std::any_of(slots_.begin(), slots_.end(), [channel](const auto& slot) { return slot.second.channel == channel; });
}

void Viewer::forget(std::uint32_t channel) {
  std::erase_if(slots_, [channel](const auto& slot) { return slot.second.channel == channel; });
}

/// Queues a payload. Events queue up to a limit, beyond which the oldest is dropped; of other payloads only one waits.
void Viewer::offer(std::uint32_t channel, const ViewPayloadPointer& payload, Moment now) {
  for (auto& [id, slot] : slots_) {
    if (slot.channel != channel) continue;
    if (slot.kind == ViewChannel::Kind::event) {
      slot.waiting.push_back(payload);
      if (slot.waiting.size() <= slot.deepest) continue;
      slot.waiting.pop_front();
      ++dropped_[channel];
    } else if (slot.waiting.empty()) {
      slot.waiting.push_back(payload);
    } else {
      merge(slot, payload, now);
    }
  }
}

/// Merges a payload into the waiting one, or replaces it. A replaced payload counts as dropped unless it waited only because of
/// the channel's rate.
void Viewer::merge(Slot& slot, const ViewPayloadPointer& payload, Moment now) {
  ViewPayloadPointer& waiting = slot.waiting.front();
  if (payload->merges) {
    auto both = std::make_shared<ViewPayload>(*payload);
    for (const ViewPayload::Piece& piece : waiting->pieces)
      if (std::none_of(payload->pieces.begin(), payload->pieces.end(), [&](const auto& newer) { return newer.key == piece.key; }))
        both->pieces.push_back(piece);
    waiting = both;
    return;
  }
  waiting = payload;
  if (!slot.is_due(now)) return;
  ++dropped_[slot.channel];
  if (slot.kind != ViewChannel::Kind::picture) return;
  if (!slow_since_) send_status(foxglove::StatusLevel::warning, too_slow, slow_id);
  slow_since_ = now;
}

void Viewer::answer(const foxglove::ServiceCall& answer) {
  open_calls_ -= std::min<std::size_t>(open_calls_, 1);
  say_frame(foxglove::service_answer(answer));
}

void Viewer::fail(const foxglove::ServiceCall& call, const std::string& why) {
  open_calls_ -= std::min<std::size_t>(open_calls_, 1);
  say(foxglove::service_failure(call.service, call.call, why));
  send_status(foxglove::StatusLevel::error, why);  // Lichtblick shows this status but ignores the failure
}

void Viewer::on_parameters(std::span<const foxglove::Parameter> changed) {
  std::vector<foxglove::Parameter> wanted;
  for (const foxglove::Parameter& p : changed)
    if (watches_all_ || watched_.contains(p.name)) wanted.push_back(p);
  if (!wanted.empty()) say(foxglove::parameter_values(wanted, std::nullopt));
}

// ---- to the socket

/// Returns the waiting slot whose last message was sent longest ago.
Viewer::Slot* Viewer::next_slot(bool last_values, Moment now, std::uint32_t& subscription) {
  Slot* best = nullptr;
  for (auto& [id, slot] : slots_) {
    const bool is_last_value = slot.kind == ViewChannel::Kind::last_value;
    if (is_last_value != last_values || slot.waiting.empty() || !slot.is_due(now)) continue;
    if (best != nullptr && best->sent_at.value_or(Moment::min()) <= slot.sent_at.value_or(Moment::min())) continue;
    best = &slot;
    subscription = id;
  }
  return best;
}

/// Queues the removal of expired statuses. Then returns messages in this order: JSON texts, the time, last values, pictures and
/// events.
std::optional<ViewMessage> Viewer::next(Moment now) {
  if (slow_since_ && now - *slow_since_ >= slow_is_said_for) {
    slow_since_.reset();
    say(foxglove::remove_status(slow_id));
  }
  for (auto it = passing_.begin(); it != passing_.end();) {
    const bool is_over = it->second <= now;
    if (is_over) say(foxglove::remove_status(it->first));
    it = is_over ? passing_.erase(it) : std::next(it);
  }
  if (!words_.empty()) {
    ViewMessage word = std::move(words_.front());
    words_.pop_front();
    word_bytes_ -= std::min(word_bytes_, word.head.size());
    return word;
  }
  if (time_ && (!time_sent_ || now - *time_sent_ >= between_times)) {
    time_sent_ = now;
    return ViewMessage{false, foxglove::time_frame(*std::exchange(time_, std::nullopt)), {}};
  }
  std::uint32_t subscription = 0;
  Slot* slot = next_slot(true, now, subscription);
  if (slot == nullptr) slot = next_slot(false, now, subscription);
  if (slot == nullptr) return std::nullopt;
  const ViewPayloadPointer payload = std::move(slot->waiting.front());
  slot->waiting.pop_front();
  slot->sent_at = now;
  ViewMessage message{false, foxglove::message_head(subscription, payload->at), {}};
  for (const ViewPayload::Piece& piece : payload->pieces) message.pieces.push_back(piece.bytes);
  return message;
}

/// Considers everything that next() may return later, because otherwise a due message would wait for the next event.
std::optional<Viewer::Moment> Viewer::next_due(Moment now) const {
  std::optional<Moment> due;
  const auto consider = [&due](Moment at) { due = due ? std::min(*due, at) : at; };
  if (!words_.empty()) consider(now);
  if (slow_since_) consider(*slow_since_ + slow_is_said_for);
  for (const auto& [id, until] : passing_) consider(until);
  if (time_) consider(time_sent_ ? *time_sent_ + between_times : now);
  for (const auto& [id, slot] : slots_)
    if (!slot.waiting.empty()) consider(slot.sent_at ? *slot.sent_at + slot.interval : now);
  return due;
}

}  // namespace sonar
