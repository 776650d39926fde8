#include "daemon/emulator/view/recording_player.hpp"

#include <algorithm>
#include <utility>

namespace sonar {

/// A time that decreases is replaced by that of the previous ping.
std::optional<RecordingPlayer::Shown> RecordingPlayer::read() {
  auto found = pings_.next();
  if (!found) return std::nullopt;
  if (!begin_) begin_ = found->at;
  const Ns at = pings_.reader().knows_times() ? found->at - *begin_ : static_cast<std::int64_t>(read_) * interval_;
  ++read_;
  last_ = std::max(last_, at);
  return Shown{last_, std::move(found->ping)};
}

/// Reads to the end once; afterwards the recording is at its start.
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

/// Recordings can only be read forwards; for an earlier time reading begins at the start again.
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

}  // namespace sonar
