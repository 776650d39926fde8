// Messages that wait for one client: the one being written, replies in order, and at most `depth` pings. The Sonar adds messages;
// the session fetches them. All messages are complete, so they are never cut or mixed.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/units.hpp"
#include "daemon/config/runtime_options.hpp"
#include "daemon/emulator/connections/pacer.hpp"
#include "daemon/emulator/world/world.hpp"

namespace sonar {

/// The reason why a client did not receive an offered ping completely.
enum class DropReason {
  slow,   // a newer ping replaced the ping, or the queue was full
  gone,   // the connection had ended, or the stream had no receivers
  stop,   // sonard ended the connection; only the current message is completed
  fault,  // a fault injected by the user
};
inline constexpr std::size_t drop_reasons = 4;

// Counters and histograms of one sonar. The Sonar updates the values, and prometheus.hpp prints them.

/// A histogram of durations. The bounds are fixed, so that add() needs no memory and runs can be compared.
class Histogram {
 public:
  static constexpr std::array bounds_s{0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02,
                                       0.05,   0.1,    0.2,    0.5,   1.0,   2.0,   5.0,  10.0};

  /// Adds a duration; a negative one counts as 0.
  void add(double seconds);
  std::uint64_t count() const { return count_; }
  double sum_s() const { return sum_s_; }
  /// Returns the counts. Element i counts durations above bounds_s[i - 1] up to bounds_s[i]; the last element counts those beyond
  /// all bounds.
  const std::array<std::uint64_t, bounds_s.size() + 1>& counts() const { return counts_; }
  /// Estimates a quantile, q in [0, 1], with linear interpolation between two bounds; the error is at most a factor of 2.5.
  /// Returns the last bound for a quantile beyond it, and 0 for an empty histogram.
  double quantile_s(double q) const;

 private:
  std::array<std::uint64_t, bounds_s.size() + 1> counts_{};
  std::uint64_t count_ = 0;
  double sum_s_ = 0;
};

/// The counters of one sonar. ticks = pings + skipped (+ one ping being computed, + a waiting tick or trigger);
/// pings = refused + unwanted + those offered to clients; offered = sent + dropped (+ those in the outboxes now).
struct DeviceFigures {
  std::uint64_t ticks = 0;
  std::uint64_t skipped_ticks = 0;  // number of ticks without a ping
  SkippedTicks skipped;             // skipped ticks by reason
  std::uint64_t skipped_stale = 0;  // one more reason: the vehicle's poses had stopped (poses.on_stale: stop)
  std::uint64_t pings = 0;          // simulated pings
  std::uint64_t refused = 0;        // pings that the engine refused
  std::uint64_t unwanted = 0;       // pings whose clients had left or had requested other settings
  std::uint64_t out_of_water = 0;   // pings of noise only, because the sonar was above the sea surface
  std::uint64_t served = 0;         // pings that at least one client received completely
  std::uint64_t offered = 0;        // pings offered to clients, counted once per client
  std::uint64_t sent = 0;           // pings that a client received completely, counted once per client
  std::uint64_t dropped = 0;        // offered pings that a client did not receive completely
  std::array<std::uint64_t, drop_reasons> dropped_by{};  // dropped pings by DropReason
  std::uint64_t waiting = 0;                             // pings in outboxes now that are not being written yet
  std::uint64_t clients = 0, refused_clients = 0;        // served and refused clients since the start
  std::uint64_t clients_now = 0, clients_queued = 0;
  std::uint64_t bytes_written = 0, bytes_read = 0;
  double simulation_s = 0;  // wall time of all pings
  Histogram simulation;     // time to compute a ping
  Histogram lateness;       // delay from a tick's time to its processing
  Histogram jitter;         // difference between the interval at which two pings were sent and that of their ticks
  Histogram latency;        // time from a ping's tick until the kernel has the last byte, for each client
};

class Outbox {
 public:
  using Bytes = std::vector<std::byte>;
  /// The pauses in the writing of a message, which a fault or the port's gap causes, and the end of the connection after the
  /// message. The bytes do not change.
  struct Shape {
    struct Pause {
      std::size_t before = 0;             // index of the byte after the pause
      std::chrono::nanoseconds length{};  // duration; 0: a separate write without a pause
    };
    std::vector<Pause> pauses;                            // by increasing index
    enum class End { none, fin, reset } end = End::none;  // how the connection ends after the last byte
  };
  struct Message {
    std::shared_ptr<const Bytes> bytes;
    std::uint32_t ping = 0;       // number of the ping; 0 = a reply
    std::vector<Bytes> prefixes;  // the ping is sent once after each prefix; none = sent once, without a prefix
    Time fired_at{};              // when the ping was fired
    std::shared_ptr<const std::vector<Bytes>> datagrams = nullptr;  // datagrams of a ping, instead of `bytes`
    std::shared_ptr<const Shape> shape = nullptr;  // shape of a message without prefixes and datagrams; may be empty
    explicit operator bool() const { return bytes != nullptr || datagrams != nullptr; }
    std::size_t size() const;  // in bytes, without prefixes
  };
  static constexpr std::size_t most_ping_bytes = 8u << 20;                    // limit for the waiting pings of one client
  static constexpr std::size_t most_held = 128, most_held_bytes = 64u << 20;  // limits for pings that a fault holds back
  static constexpr std::size_t most_reply_bytes = 64u << 10;  // limit for clients that send requests but do not read
  static constexpr std::size_t most_replies = 256;

  explicit Outbox(OutboxRules rules) : rules_(rules) {}

  /// Returns false if too many replies wait; the session must then be closed.
  bool push_reply(Bytes reply);
  void push_ping(std::shared_ptr<const Bytes> bytes, std::uint32_t number, std::vector<Bytes> prefixes = {}, Time fired_at = {}) {
    push_ping({std::move(bytes), number, std::move(prefixes), fired_at});
  }
  void push_ping(Message ping) { push(std::move(ping), static_cast<std::size_t>(rules_.depth), most_ping_bytes); }
  /// Adds a ping that a fault held back. The limit is the number that a fault may hold, not the depth.
  void push_held(Message ping) { push(std::move(ping), most_held, most_held_bytes); }
  /// Returns the next message to write, replies before pings; returns an empty one while a message is being written or if none
  /// waits.
  Message take();
  /// Call it when the message that take() returned was written completely.
  void written();
  /// Call it when the message that take() returned could not be written; it counts as dropped. Later messages may follow.
  void not_written(DropReason why = DropReason::gone);
  /// Counts a ping as offered and dropped, without queueing it.
  void drop_offered(DropReason why) { ++pings_offered_, count_drop(why); }
  void use(OutboxRules rules) { rules_ = rules; }
  /// Drops the waiting pings. The current message and the replies, which are small, are kept.
  void drop_waiting_pings(DropReason why = DropReason::stop);
  /// Call it when the connection has ended: drops all messages, including the current one.
  void end(DropReason why);

  bool idle() const { return !writing_ && replies_.empty() && pings_.empty(); }
  /// At any moment, offered = written + dropped + waiting + 1 if a ping is being written.
  std::uint64_t pings_offered() const { return pings_offered_; }
  std::uint64_t pings_written() const { return pings_written_; }
  std::uint64_t pings_dropped() const;
  const std::array<std::uint64_t, drop_reasons>& dropped_by_reason() const { return dropped_; }
  std::size_t pings_waiting() const { return pings_.size(); }

 private:
  void push(Message ping, std::size_t most, std::size_t most_bytes);
  void count_drop(DropReason why, std::uint64_t pings = 1) { dropped_[static_cast<std::size_t>(why)] += pings; }

  OutboxRules rules_;
  std::deque<Bytes> replies_;
  std::size_t reply_bytes_ = 0;
  std::deque<Message> pings_;
  std::size_t ping_bytes_ = 0;
  bool writing_ = false, writing_ping_ = false;
  std::uint64_t pings_offered_ = 0, pings_written_ = 0;
  std::array<std::uint64_t, drop_reasons> dropped_{};
};

}  // namespace sonar
