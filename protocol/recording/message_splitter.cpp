#include "protocol/recording/message_splitter.hpp"

#include <algorithm>

namespace sonar::recording {
namespace {

constexpr std::byte first_magic{oculus::magic & 0xFF}, second_magic{oculus::magic >> 8};

bool starts_like_header(wire::BytesView bytes) {
  return !bytes.empty() && bytes[0] == first_magic && (bytes.size() < 2 || bytes[1] == second_magic);
}

}  // namespace

bool is_known(const oculus::MessageHeader& header) {
  using enum oculus::MessageType;
  switch (header.type) {
    case status:
    case fire:
    case full_ping_result:
    case ping_result:
    case user_config:
    case log:
    case dummy:
      return true;
  }
  return false;
}

void MessageSplitter::append(Time at, wire::BytesView bytes) {
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin_));
  begin_ = 0;
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  at_ = at;
  finished_ = false;
}

RecordedMessage MessageSplitter::cut(std::size_t count) {
  const auto bytes = wire::BytesView(buffer_).subspan(begin_, count);
  begin_ += count;
  return {at_, from_, Carrier::stream, {bytes.begin(), bytes.end()}};
}

void MessageSplitter::lose(std::size_t count) {
  begin_ += count;
  lost_bytes_ += count;
}

void MessageSplitter::break_off() {
  if (waiting_bytes() > 0) ++losses_;
  lose(waiting_bytes());
  lost_ = strict_ = true;
}

/// Length of the message that begins here; 0 = not yet known; nullopt = no message begins here. After lost bytes only headers
/// of known types count: two bytes of an image soon look like the magic number.
std::optional<std::size_t> MessageSplitter::length_at_front(wire::BytesView waiting) const {
  if (!starts_like_header(waiting)) return std::nullopt;
  if (waiting.size() < oculus::header_size) return 0;
  const oculus::MessageHeader header = oculus::header_of(waiting);
  if (strict_ && !is_known(header)) return std::nullopt;
  return oculus::message_length(header, from_ == Origin::device ? oculus::Sender::device : oculus::Sender::client);
}

std::optional<RecordedMessage> MessageSplitter::next() {
  while (waiting_bytes() > 0) {
    const auto waiting = wire::BytesView(buffer_).subspan(begin_);
    if (const auto length = length_at_front(waiting)) {
      if (*length > 0 && waiting.size() >= *length) {
        lost_ = strict_ = false;
        return cut(*length);
      }
      if (!finished_) return std::nullopt;
      if (!lost_) ++losses_;  // a message begins and never ends
      lost_ = strict_ = true;
      lose(1);
      continue;
    }
    strict_ = true;
    std::size_t none = 1;
    while (none < waiting.size() && !starts_like_header(waiting.subspan(none))) ++none;
    if (!lost_) return cut(none);
    lose(none);
  }
  return std::nullopt;
}

void MessageSplitter::finish() { finished_ = true; }

}  // namespace sonar::recording
