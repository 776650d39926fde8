// One viewer of the live view, without its socket. It converts the viewer's messages to requests to the host, and subscriptions
// to messages to write; if the viewer is slow, newer messages replace older ones. It has no I/O: the caller passes bytes and
// times, and gets messages.
//
// Messages are sent in this order: JSON texts and answers, which are never dropped; last values (a newer value replaces an older
// one); pictures and events. In a channel of pictures only the newest waits, in a channel of events the newest 64.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/foxglove/foxglove_frames.hpp"
#include "protocol/foxglove/foxglove_words.hpp"

namespace sonar {

using ViewBytes = std::shared_ptr<const wire::Bytes>;

/// A channel, offered to all viewers.
struct ViewChannel {
  enum class Kind { last_value, picture, event };
  foxglove::Channel advertised;
  Kind kind = Kind::last_value;
  double most_hz = 0;        // 0 = no limit
  std::size_t deepest = 64;  // most waiting events
};

/// A message of a channel, in pieces; all viewers share it.
struct ViewPayload {
  struct Piece {
    std::string key;  // a later piece with the same key replaces this piece
    ViewBytes bytes;
  };
  Time at{};
  std::vector<Piece> pieces;
  bool merges = false;  // true: waiting pieces with other keys are kept, and all pieces together are one message
};
using ViewPayloadPointer = std::shared_ptr<const ViewPayload>;

/// One WebSocket message to write.
struct ViewMessage {
  bool is_text = false;
  wire::Bytes head;               // the whole message, except for channels
  std::vector<ViewBytes> pieces;  // bytes after `head`
};

struct ViewerFigures {
  std::string address;  // such as "http 127.0.0.1:40123"
  bool may_steer = false;
  std::map<std::string, std::uint64_t> dropped = {};  // number of replaced messages by topic
};

class Viewer;

/// The part of the daemon that answers viewers. It must outlive all viewers, and may call a viewer back.
class ViewerHost {
 public:
  virtual ~ViewerHost() = default;
  /// Returns the channel with this id, or null.
  virtual const ViewChannel* channel(std::uint32_t id) const = 0;
  /// Offers the present values of a channel to a new subscriber.
  virtual void on_subscribed(Viewer& viewer, std::uint32_t channel) = 0;
  /// Returns the parameters with these names, or all if `names` is empty. Ignores unknown names.
  virtual std::vector<foxglove::Parameter> parameters(const Viewer& viewer, const std::vector<std::string>& names) = 0;
  /// Sets a parameter. Returns the reason if it was not set, else an empty text.
  virtual std::string set_parameter(Viewer& viewer, const foxglove::Parameter& wanted) = 0;
  /// Controls the trajectory and answers with the state of playback. Returns false if the viewer does not watch a trajectory.
  virtual bool steer_playback(Viewer& viewer, const foxglove::PlaybackControl& asked) = 0;
  /// Performs a call and answers with Viewer::answer() or fail(), now or later.
  virtual void call(Viewer& viewer, const foxglove::ServiceCall& call) = 0;
};

class Viewer {
 public:
  /// A time that never decreases, with any origin.
  using Moment = std::chrono::nanoseconds;
  struct Rights {
    bool may_steer = false;
    double most_hz = 0;  // limit for the rate of pictures; 0 = none
  };
  enum class CloseCode : std::uint16_t { none = 0, policy = 1008, try_again_later = 1013 };
  static constexpr const char* read_only = "this connection is read-only";
  static constexpr std::size_t most_subscriptions = 256, most_words = 256, most_word_bytes = std::size_t{1} << 20, most_calls = 4;

  /// `who`: the viewer's address, for the log.
  Viewer(ViewerHost& host, Rights rights, std::string who) : host_(host), rights_(rights), who_(std::move(who)) {}

  // ---- from the socket
  void on_text(std::string_view text, Moment now);
  void on_binary(wire::BytesView frame, Moment now);
  /// Returns the next message to write; nullopt: wait until something is offered, or until next_due().
  std::optional<ViewMessage> next(Moment now);
  /// Returns the time at which next() must be called again, because a message waits for its rate or a warning ends.
  std::optional<Moment> next_due(Moment now) const;
  /// If the code is not `none`, the connection must be closed with this code.
  CloseCode close_code() const { return close_; }

  // ---- from the host
  /// Adds a message of the greeting, without the limit of waiting messages.
  void greet(std::string word) { words_.push_back({true, bytes_of(word), {}}); }
  void say(std::string word);
  void say_frame(wire::Bytes frame);
  void send_status(foxglove::StatusLevel level, const std::string& text, const std::string& id = {}) {
    say(foxglove::status(level, text, id));
  }
  /// Shows a status, which is removed after `lasts`.
  void show_for_now(const std::string& text, const std::string& id, Moment now, Moment lasts);
  void offer(std::uint32_t channel, const ViewPayloadPointer& payload, Moment now);
  bool subscribes(std::uint32_t channel) const;
  bool subscribes_any() const { return !slots_.empty(); }
  /// Removes a channel that no longer exists, with its waiting messages.
  void forget(std::uint32_t channel);
  /// Sends the daemon's time, at most 30 times a second; the last value is always sent.
  void set_time(Time now) {
    if (std::exchange(newest_time_, now) != now) time_ = now;
  }
  void answer(const foxglove::ServiceCall& answer);
  void fail(const foxglove::ServiceCall& call, const std::string& why);
  /// Sends the changed parameters that the viewer watches.
  void on_parameters(std::span<const foxglove::Parameter> changed);
  bool watches_parameters() const { return watches_all_ || !watched_.empty(); }

  /// Sets the vehicle whose trajectory the viewer watches; times are then those of the trajectory. Empty = none.
  void play(std::string vehicle) { playback_ = std::move(vehicle); }
  const std::string& playback() const { return playback_; }
  /// Sets a parameter of this connection only.
  void choose(const std::string& parameter, double value) { choices_[parameter] = value; }
  double choice(const std::string& parameter, double usual) const {
    const auto found = choices_.find(parameter);
    return found == choices_.end() ? usual : found->second;
  }

  bool may_steer() const { return rights_.may_steer; }
  const std::string& who() const { return who_; }
  /// Returns the number of messages that were replaced before they were written, by channel.
  const std::map<std::uint32_t, std::uint64_t>& dropped() const { return dropped_; }

 private:
  struct Slot {
    std::uint32_t channel = 0;
    ViewChannel::Kind kind{};
    Moment interval{0};
    std::size_t deepest = 1;
    std::optional<Moment> sent_at;
    std::deque<ViewPayloadPointer> waiting;  // at most one payload, except for events
    bool is_due(Moment now) const { return !sent_at || now - *sent_at >= interval; }
  };
  static wire::Bytes bytes_of(std::string_view text);
  void add_word(ViewMessage word);
  bool has_room_for_message(Moment now);
  void complain(const std::string& why);
  void warn_ignored(const std::string& what);
  void on_word(const foxglove::Subscribe& word, Moment);
  void on_word(const foxglove::Unsubscribe& word, Moment);
  void on_word(const foxglove::GetParameters& word, Moment);
  void on_word(const foxglove::SetParameters& word, Moment now);
  void on_word(const foxglove::WatchParameters& word, Moment);
  void on_word(const foxglove::Incapable& word, Moment);
  void on_word(const foxglove::UnknownWord& word, Moment);
  void merge(Slot& slot, const ViewPayloadPointer& payload, Moment now);
  Slot* next_slot(bool last_values, Moment now, std::uint32_t& subscription);

  ViewerHost& host_;
  Rights rights_;
  std::string who_, playback_;
  std::map<std::string, double> choices_;
  std::deque<ViewMessage> words_;
  std::size_t word_bytes_ = 0;
  std::map<std::uint32_t, Slot> slots_;  // key: subscription
  std::map<std::uint32_t, std::uint64_t> dropped_;
  std::optional<Time> time_, newest_time_;
  std::optional<Moment> time_sent_, slow_since_, allowance_at_;
  std::map<std::string, Moment> passing_;  // time at which each temporary status is removed
  std::set<std::string> watched_;
  bool watches_all_ = false, warned_unknown_ = false;
  double allowance_ = 200;  // number of messages that the viewer may send now
  int complaints_ = 0;
  std::size_t open_calls_ = 0;
  CloseCode close_ = CloseCode::none;
};

}  // namespace sonar
