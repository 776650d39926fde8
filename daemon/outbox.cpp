#include "daemon/outbox.hpp"

#include <cassert>
#include <utility>

namespace sonar {

bool Outbox::push_reply(Bytes reply) {
  if (replies_.size() >= most_replies || reply_bytes_ + reply.size() > most_reply_bytes) return false;
  reply_bytes_ += reply.size();
  replies_.push_back(std::move(reply));
  return true;
}

void Outbox::push_ping(std::shared_ptr<const Bytes> bytes, std::uint32_t number, std::vector<Bytes> prefixes) {
  const auto full = [&] {
    return !pings_.empty() &&
           (pings_.size() >= static_cast<std::size_t>(rules_.depth) || ping_bytes_ + bytes->size() > most_ping_bytes);
  };
  if (full() && rules_.when_full == WhenFull::drop_newest) {
    ++pings_dropped_;
    return;
  }
  while (full()) {
    ping_bytes_ -= pings_.front().bytes->size();
    pings_.pop_front();
    ++pings_dropped_;
  }
  ping_bytes_ += bytes->size();
  pings_.push_back({std::move(bytes), number, std::move(prefixes)});
}

Outbox::Message Outbox::take() {
  if (writing_ || (replies_.empty() && pings_.empty())) return {};
  writing_ = true;
  writing_ping_ = replies_.empty();
  if (writing_ping_) {
    Message ping = std::move(pings_.front());
    pings_.pop_front();
    ping_bytes_ -= ping.bytes->size();
    return ping;
  }
  auto reply = std::make_shared<const Bytes>(std::move(replies_.front()));
  replies_.pop_front();
  reply_bytes_ -= reply->size();
  return {std::move(reply), 0, {}};
}

void Outbox::written() {
  assert(writing_);
  if (writing_ping_) ++pings_written_;
  writing_ = false;
}

void Outbox::drop_waiting_pings() {
  pings_dropped_ += pings_.size();
  pings_.clear();
  ping_bytes_ = 0;
}

}  // namespace sonar
