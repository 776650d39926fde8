#include "daemon/emulator/view/playback_watch.hpp"

#include <algorithm>

namespace sonar {
namespace {

constexpr std::chrono::milliseconds slack{1};  // for the rounding at a change of speed or a pause

}  // namespace

PlaybackWatch::PlaybackWatch(const motion::Playback& of, Time now) : playback_(of), looked_at_(now), sent_(state(now)) {}

/// A position that playing since the last look cannot explain is a seek.
std::optional<foxglove::PlaybackState> PlaybackWatch::look(const motion::Playback* of, Time now) {
  const double before = playback_.rules().speed.factor();
  if (of != nullptr)
    playback_ = *of;
  else if (!playback_.paused())
    playback_.pause(now);
  // Speed and pause may have changed at any moment since the last look.
  const double fastest = std::max(before, playback_.rules().speed.factor());
  const Time farthest = sent_.at + nanoseconds_from(fastest * seconds(now - looked_at_)) + slack;
  foxglove::PlaybackState holds = state(now);
  holds.did_seek = holds.at + slack < sent_.at || holds.at > farthest;
  const bool is_news = holds.did_seek || holds.status != sent_.status || holds.speed != sent_.speed;
  looked_at_ = now;
  sent_ = holds;
  return is_news ? std::optional(holds) : std::nullopt;
}

foxglove::PlaybackState PlaybackWatch::state(Time now) const {
  using Status = foxglove::PlaybackStatus;
  foxglove::PlaybackState holds;
  holds.status = playback_.ended(now) ? Status::ended : playback_.paused() ? Status::paused : Status::playing;
  holds.at = stamp(now);
  holds.speed = static_cast<float>(playback_.rules().speed.factor());
  return holds;
}

}  // namespace sonar
