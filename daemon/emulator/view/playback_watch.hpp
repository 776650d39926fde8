// The state of playback that viewers of a vehicle's trajectory see (docs/live-view.md): the trajectory's time for a time of the
// daemon, and changes by steps: pause, speed, the end, a jump to another time. Pure.
#pragma once

#include <optional>

#include "core/motion/playback.hpp"
#include "protocol/foxglove/foxglove_frames.hpp"

namespace sonar {

class PlaybackWatch {
 public:
  PlaybackWatch(const motion::Playback& of, Time now);

  /// Returns the state if it changed by a step since the last look; nullopt if it was played on. The begin of a new round of a
  /// loop counts as a seek. `of`: null = the vehicle follows its trajectory no longer, which counts as a pause.
  std::optional<foxglove::PlaybackState> look(const motion::Playback* of, Time now);
  foxglove::PlaybackState state(Time now) const;
  /// The trajectory's time, from 0 to end(). A time before the last seek counts as if it had been played until then.
  Time stamp(Time daemon) const { return Time{} + playback_.place(daemon).at; }
  Time end() const { return Time{} + playback_.duration(); }

 private:
  motion::Playback playback_;
  Time looked_at_{};
  foxglove::PlaybackState said_;
};

}  // namespace sonar
