// Finds the ping of a recording that is shown at a moment (the last one at or before it), and the length of the recording. Pure;
// the caller chooses how many steps it takes at a time.
#pragma once

#include <cstdint>
#include <optional>

#include "protocol/recording/recorded_pings.hpp"

namespace sonar {

class RecordingPlayer {
 public:
  using Ns = std::chrono::nanoseconds;
  struct Shown {
    Ns at{0};  // from the first ping
    protocol::HostPing ping;
  };

  /// `interval`: between pings of recordings that store no times.
  RecordingPlayer(recording::RecordedPings pings, Ns interval) : pings_(std::move(pings)), interval_(interval) {}

  /// Reads one ping more to find the recording's length. False: there are no more, and the recording is at its start again.
  bool measure();
  Time begin() const { return begin_.value_or(Time{}); }
  /// Time from the first ping to the last.
  Ns length() const { return length_; }
  std::uint64_t count() const { return count_; }
  const recording::SentBy& by() const { return pings_.by(); }

  /// Reads one ping more towards the last one at or before `at`; false: that one is shown.
  bool approach(Ns at);
  /// Null: none was read yet.
  const Shown* shown() const { return shown_ ? &*shown_ : nullptr; }

 private:
  std::optional<Shown> read();

  recording::RecordedPings pings_;
  Ns interval_, length_{0}, last_{0};
  std::optional<Time> begin_;
  std::uint64_t count_ = 0, read_ = 0;
  std::optional<Shown> shown_, next_;
};

}  // namespace sonar
