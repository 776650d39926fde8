// What one client is still to be sent: the message being written, control replies in order, and at most `depth` waiting pings.
// Filled by the Device, emptied by the Session's writer; whole messages only, so a stream can never be cut or mixed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

namespace sonar {

enum class WhenFull { replace_oldest, drop_newest };

struct OutboxRules {
  int depth = 1;  // waiting pings beside the message being written, 1..3
  WhenFull when_full = WhenFull::replace_oldest;
};

class Outbox {
 public:
  using Bytes = std::vector<std::byte>;
  struct Message {
    std::shared_ptr<const Bytes> bytes;
    std::uint32_t ping = 0;       // its number; 0 = a reply
    std::vector<Bytes> prefixes;  // of a ping: it is sent once for each, the prefix first; none = once, as it is
    explicit operator bool() const { return bytes != nullptr; }
  };
  static constexpr int deepest = 3;
  static constexpr std::size_t most_ping_bytes = 8u << 20;    // waiting pings of one client
  static constexpr std::size_t most_reply_bytes = 64u << 10;  // a client that asks and never reads
  static constexpr std::size_t most_replies = 256;

  explicit Outbox(OutboxRules rules) : rules_(rules) {}

  /// False when replies pile up beyond their bound: the session must be closed.
  bool push_reply(Bytes reply);
  void push_ping(std::shared_ptr<const Bytes> bytes, std::uint32_t number, std::vector<Bytes> prefixes = {});
  /// The next message to write, whole: replies before pings. Empty while one is being written, or when there is nothing.
  Message take();
  /// The message last taken has been written to its end.
  void written();
  /// Leaves the message being written and the replies, which are small.
  void drop_waiting_pings();

  bool idle() const { return !writing_ && replies_.empty() && pings_.empty(); }
  std::uint64_t pings_written() const { return pings_written_; }
  std::uint64_t pings_dropped() const { return pings_dropped_; }

 private:
  OutboxRules rules_;
  std::deque<Bytes> replies_;
  std::size_t reply_bytes_ = 0;
  std::deque<Message> pings_;
  std::size_t ping_bytes_ = 0;
  bool writing_ = false, writing_ping_ = false;
  std::uint64_t pings_written_ = 0, pings_dropped_ = 0;
};

}  // namespace sonar
