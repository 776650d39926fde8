#include "daemon/emulator/connections/outbox.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace sonar {

void Histogram::add(double seconds) {
  seconds = std::max(seconds, 0.0);
  const auto bound = std::lower_bound(bounds_s.begin(), bounds_s.end(), seconds);
  ++counts_[static_cast<std::size_t>(bound - bounds_s.begin())];
  ++count_;
  sum_s_ += seconds;
}

// Assumes that durations are evenly spread within a bin.
double Histogram::quantile_s(double q) const {
  if (count_ == 0) return 0;
  const double rank = std::clamp(q, 0.0, 1.0) * static_cast<double>(count_);
  double below = 0, lower_s = 0;
  for (std::size_t i = 0; i < bounds_s.size(); ++i) {
    const auto here = static_cast<double>(counts_[i]);
    if (here > 0 && below + here >= rank) return lower_s + (bounds_s[i] - lower_s) * std::max(rank - below, 0.0) / here;
    below += here;
    lower_s = bounds_s[i];
  }
  return bounds_s.back();
}

/// Limits the replies, because some clients send requests but do not read the replies.
bool Outbox::push_reply(Bytes reply) {
  if (replies_.size() >= most_replies || reply_bytes_ + reply.size() > most_reply_bytes) return false;
  reply_bytes_ += reply.size();
  replies_.push_back(std::move(reply));
  return true;
}

std::size_t Outbox::Message::size() const {
  std::size_t all = bytes ? bytes->size() : 0;
  if (datagrams)
    for (const Bytes& datagram : *datagrams) all += datagram.size();
  return all;
}

// A slow client gets the newest pings: the oldest waiting ping is dropped (only a fault uses drop_newest). The message that is
// being written is never dropped, because that would cut the stream.
void Outbox::push(Message ping, std::size_t most, std::size_t most_bytes) {
  const std::size_t size = ping.size();
  ++pings_offered_;
  // An empty queue accepts any ping, so that a ping larger than most_bytes can be sent.
  const auto full = [&] { return !pings_.empty() && (pings_.size() >= most || ping_bytes_ + size > most_bytes); };
  if (full() && rules_.when_full == WhenFull::drop_newest) {
    count_drop(DropReason::slow);
    return;
  }
  // Drops the oldest pings, so that a slow client gets the newest picture.
  while (full()) {
    ping_bytes_ -= pings_.front().size();
    pings_.pop_front();
    count_drop(DropReason::slow);
  }
  ping_bytes_ += size;
  pings_.push_back(std::move(ping));
}

// Replies come before pings, because a client may wait for a reply before it reads more. Only one message is returned at a time:
// the caller reports the end with written() or not_written().
Outbox::Message Outbox::take() {
  if (writing_ || (replies_.empty() && pings_.empty())) return {};
  writing_ = true;
  // Replies come first: they are small, and they are never dropped.
  writing_ping_ = replies_.empty();
  if (writing_ping_) {
    Message ping = std::move(pings_.front());
    pings_.pop_front();
    ping_bytes_ -= ping.size();
    return ping;
  }
  auto reply = std::make_shared<const Bytes>(std::move(replies_.front()));
  replies_.pop_front();
  reply_bytes_ -= reply->size();
  return {std::move(reply), 0, {}, {}};
}

void Outbox::written() {
  assert(writing_);
  if (writing_ping_) ++pings_written_;
  writing_ = false;
}

void Outbox::not_written(DropReason why) {
  assert(writing_);
  if (writing_ping_) count_drop(why);
  writing_ = false;
}

void Outbox::drop_waiting_pings(DropReason why) {
  count_drop(why, pings_.size());
  pings_.clear();
  ping_bytes_ = 0;
}

// Each offered ping is counted once, including the one that is being written: offered = written + dropped (+ waiting).
void Outbox::end(DropReason why) {
  drop_waiting_pings(why);
  // The message being written is incomplete at the client, so its ping counts as dropped.
  if (std::exchange(writing_, false) && writing_ping_) count_drop(why);
  replies_.clear();
  reply_bytes_ = 0;
}

std::uint64_t Outbox::pings_dropped() const { return std::accumulate(dropped_.begin(), dropped_.end(), std::uint64_t{0}); }

}  // namespace sonar
