#include "daemon/emulator/view/recording_player.hpp"

#include <algorithm>
#include <utility>

namespace sonar {

/// Reads a ping. A time that decreases is replaced with the time of the previous ping.
std::optional<RecordingPlayer::Shown> RecordingPlayer::read() {
  auto found = pings_.next();
  if (!found) return std::nullopt;
  if (!begin_) begin_ = found->at;
  const Ns at = pings_.reader().knows_times() ? found->at - *begin_ : static_cast<std::int64_t>(read_) * interval_;
  ++read_;
  last_ = std::max(last_, at);
  return Shown{last_, std::move(found->ping)};
}

/// Reads to the end once, then rewinds the recording.
bool RecordingPlayer::measure() {
  if (const auto ping = read()) {
    length_ = ping->at;
    ++count_;
    return true;
  }
  pings_.rewind();
  read_ = 0;
  last_ = Ns{0};
  return false;
}

/// Reads forwards only; for an earlier time, rewinds the recording first.
bool RecordingPlayer::approach(Ns at) {
  if (shown_ && at < shown_->at) {
    pings_.rewind();
    read_ = 0;
    last_ = Ns{0};
    shown_.reset();
    next_.reset();
  }
  if (!next_) next_ = read();
  if (!next_ || (shown_ && next_->at > at)) return false;
  shown_ = std::exchange(next_, std::nullopt);
  return true;
}

namespace {

constexpr std::chrono::milliseconds slack{1};  // tolerance for rounding at a change of speed or a pause

}  // namespace

PlaybackWatch::PlaybackWatch(const motion::Playback& of, Time now) : playback_(of), looked_at_(now), sent_(state(now)) {}

/// Detects sudden changes. A position that playback since the last call cannot have reached is a seek.
std::optional<foxglove::PlaybackState> PlaybackWatch::look(const motion::Playback* of, Time now) {
  const double before = playback_.rules().speed.factor();
  if (of != nullptr)
    playback_ = *of;
  else if (!playback_.paused())
    playback_.pause(now);
  // Speed and pause may have changed at any time since the last call.
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
