// The state of playback for viewers of a vehicle's trajectory (docs/live-view.md): the trajectory's time for a time of the
// daemon, and sudden changes: pause, speed, the end, a seek. Pure.
#pragma once

#include <optional>

#include "core/motion/playback.hpp"
#include "protocol/foxglove/foxglove_frames.hpp"

namespace sonar {

class PlaybackWatch {
 public:
  PlaybackWatch(const motion::Playback& of, Time now);

  /// Returns the state if it changed suddenly since the last call; nullopt if playing just continued. The start of a new round
  /// of a loop counts as a seek. `of`: null = the vehicle no longer follows its trajectory, which counts as a pause.
  std::optional<foxglove::PlaybackState> look(const motion::Playback* of, Time now);
  foxglove::PlaybackState state(Time now) const;
  /// The trajectory's time, from 0 to end(). Times before the last seek are computed as if playing had always continued.
  Time stamp(Time daemon) const { return Time{} + playback_.place(daemon).at; }
  Time end() const { return Time{} + playback_.duration(); }

 private:
  motion::Playback playback_;
  Time looked_at_{};
  foxglove::PlaybackState sent_;
};

}  // namespace sonar
