// Finds the ping of a recording to show at a time (the last one at or before it), and the length of the recording. Pure; it
// works in steps, whose number the caller chooses.
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

  /// `interval`: time between pings if the recording stores no times.
  RecordingPlayer(recording::RecordedPings pings, Ns interval) : pings_(std::move(pings)), interval_(interval) {}

  /// Reads one more ping to find the recording's length. False: there are no more, and the recording is at its start again.
  bool measure();
  Time begin() const { return begin_.value_or(Time{}); }
  /// The time from the first ping to the last.
  Ns length() const { return length_; }
  std::uint64_t count() const { return count_; }
  const recording::SentBy& by() const { return pings_.by(); }

  /// Reads one more ping towards the last one at or before `at`. False: that one is now shown.
  bool approach(Ns at);
  /// Null: no ping was read yet.
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
