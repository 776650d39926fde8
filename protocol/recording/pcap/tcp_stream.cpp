#include "protocol/recording/pcap/tcp_stream.hpp"

#include <utility>

namespace sonar::recording {

void TcpStream::begin(std::uint32_t sequence, bool syn) {
  begun_ = true;
  saw_syn_ = syn;
  first_ = syn ? sequence + 1 : sequence;
  from_middle_ = !syn;
}

void TcpStream::add(Time at, std::uint32_t sequence, wire::BytesView payload, bool syn) {
  if (!begun_) {
    if (!syn && payload.empty()) return;
    begin(sequence, syn);
  }
  if (payload.empty()) return;
  // Sequence numbers wrap after 4 GiB. The difference as a signed number is right for segments up to 2 GiB early or late.
  const auto expected = static_cast<std::uint32_t>(first_ + position_);
  const auto ahead = static_cast<std::int32_t>(sequence + (syn ? 1u : 0u) - expected);
  if (ahead <= 0) {  // a segment that continues the stream, or repeats bytes of it
    const auto known = static_cast<std::size_t>(-static_cast<std::int64_t>(ahead));
    if (known >= payload.size()) return;
    give(at, payload.subspan(known));
    return give_what_follows();
  }
  // An early segment waits for the preceding ones. Of two segments at the same place the longer is kept.
  Early& early = waiting_[position_ + static_cast<std::uint32_t>(ahead)];
  if (early.bytes.size() >= payload.size()) return;
  waiting_bytes_ += payload.size() - early.bytes.size();
  early = {at, {payload.begin(), payload.end()}};
  // If too many bytes or segments wait, the preceding bytes are assumed to be missing from the capture, and are skipped.
  if (waiting_bytes_ > most_waiting_bytes || waiting_.size() > most_waiting) {
    skip_to_first_waiting();
    give_what_follows();
  }
}

void TcpStream::give(Time at, wire::BytesView bytes) {
  ready_.push_back({at, {bytes.begin(), bytes.end()}, std::exchange(missing_, 0), std::exchange(from_middle_, false)});
  position_ += bytes.size();
}

/// Moves early segments that now continue the stream to `ready_`, without the bytes that are already known.
void TcpStream::give_what_follows() {
  while (!waiting_.empty() && waiting_.begin()->first <= position_) {
    const Early early = std::move(waiting_.begin()->second);
    const std::uint64_t known = position_ - waiting_.begin()->first;
    waiting_.erase(waiting_.begin());
    waiting_bytes_ -= early.bytes.size();
    if (known < early.bytes.size()) give(early.at, wire::BytesView(early.bytes).subspan(static_cast<std::size_t>(known)));
  }
}

void TcpStream::skip_to_first_waiting() {
  if (waiting_.empty() || waiting_.begin()->first <= position_) return;
  missing_ += waiting_.begin()->first - position_;
  position_ = waiting_.begin()->first;
}

void TcpStream::finish() {
  while (!waiting_.empty()) {
    skip_to_first_waiting();
    give_what_follows();
  }
}

std::optional<TcpStream::Run> TcpStream::next() {
  if (ready_.empty()) return std::nullopt;
  Run run = std::move(ready_.front());
  ready_.pop_front();
  return run;
}

}  // namespace sonar::recording
