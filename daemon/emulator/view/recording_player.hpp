// Finds the ping of a recording to show at a time (the last ping at or before that time), and the length of the recording. It
// reads one ping in each step, and the caller chooses the number of steps.
#pragma once

#include <cstdint>
#include <optional>

#include "core/motion/trajectory.hpp"
#include "protocol/foxglove/foxglove_frames.hpp"
#include "protocol/recording/recording.hpp"

namespace sonar {

class RecordingPlayer {
 public:
  using Ns = std::chrono::nanoseconds;
  struct Shown {
    Ns at{0};  // time since the first ping
    protocol::HostPing ping;
  };

  /// `interval`: time between pings if the recording stores no times.
  RecordingPlayer(recording::RecordedPings pings, Ns interval) : pings_(std::move(pings)), interval_(interval) {}

  /// Reads one more ping to find the length of the recording. Returns false at the end, after rewinding the recording.
  bool measure();
  Time begin() const { return begin_.value_or(Time{}); }
  /// Returns the time from the first ping to the last.
  Ns length() const { return length_; }
  std::uint64_t count() const { return count_; }
  const recording::SentBy& by() const { return pings_.by(); }

  /// Reads one more ping towards the last one at or before `at`. Returns false when shown() is that ping.
  bool approach(Ns at);
  /// Returns null if no ping was read yet.
  const Shown* shown() const { return shown_ ? &*shown_ : nullptr; }

 private:
  std::optional<Shown> read();

  recording::RecordedPings pings_;
  Ns interval_, length_{0}, last_{0};
  std::optional<Time> begin_;
  std::uint64_t count_ = 0, read_ = 0;
  std::optional<Shown> shown_, next_;
};

// Determines the state of playback for viewers of a vehicle's trajectory (docs/live-view.md): the trajectory's time for a time of
// the daemon, and sudden changes (pause, speed, the end, a seek).

class PlaybackWatch {
 public:
  PlaybackWatch(const motion::Playback& of, Time now);

  /// Returns the state if it changed suddenly since the last call; nullopt if playback only continued. The start of a new round
  /// of a loop counts as a seek. `of`: null = the vehicle no longer follows its trajectory, which counts as a pause.
  std::optional<foxglove::PlaybackState> look(const motion::Playback* of, Time now);
  foxglove::PlaybackState state(Time now) const;
  /// Returns the trajectory's time, from 0 to end(). Times before the last seek are computed as if playback had always continued.
  Time stamp(Time daemon) const { return Time{} + playback_.place(daemon).at; }
  Time end() const { return Time{} + playback_.duration(); }

 private:
  motion::Playback playback_;
  Time looked_at_{};
  foxglove::PlaybackState sent_;
};

}  // namespace sonar
