#include "protocol/recorded/message_splitter.hpp"

#include <algorithm>
#include <utility>

namespace sonar::recording {
namespace {

bool begins_with(wire::BytesView bytes, const std::array<std::uint8_t, 2>& magic) {
  return !bytes.empty() && bytes[0] == std::byte{magic[0]} && (bytes.size() < 2 || bytes[1] == std::byte{magic[1]});
}

constexpr std::size_t longest_line = 1 << 16;

/// Returns the length of the line with its end; 0 if the end has not arrived yet; nullopt if the bytes are too long for a line.
std::optional<std::size_t> length_of_line(wire::BytesView waiting) {
  const auto end = std::find(waiting.begin(), waiting.end(), std::byte{'\n'});
  if (end != waiting.end()) return static_cast<std::size_t>(end - waiting.begin()) + 1;
  return waiting.size() < longest_line ? std::optional<std::size_t>(0) : std::nullopt;
}

}  // namespace

bool Framing::begins_message(wire::BytesView bytes, Origin from) const {
  if (bytes.size() < header_size || !begins_with(bytes, magic)) return false;
  return length == nullptr || length(bytes.first(header_size), from, true);
}

bool MessageSplitter::starts_like_header(wire::BytesView bytes) const { return begins_with(bytes, framing_->magic); }

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

// Bytes are missing after the waiting ones, so the incomplete message is lost, and the next bytes may be in the middle of
// another message.
void MessageSplitter::break_off() {
  if (waiting_bytes() > 0) ++losses_;
  lose(waiting_bytes());
  lost_ = strict_ = true;
}

/// Returns the length of the message that begins here; 0 if it is not known yet; nullopt if no message begins here. After lost
/// bytes (strict_) only headers of known types count, because the two bytes of the magic number often occur in an image by
/// chance.
std::optional<std::size_t> MessageSplitter::length_at_front(wire::BytesView waiting) const {
  if (!starts_like_header(waiting)) return std::nullopt;
  if (waiting.size() < framing_->header_size) return 0;
  if (framing_->length == nullptr) return length_of_line(waiting);
  return framing_->length(waiting.first(framing_->header_size), from_, strict_);
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
      // The stream ends within this message. The search continues inside the message, because it may be a false start.
      if (!lost_) ++losses_;
      lost_ = strict_ = true;
      lose(1);
      continue;
    }
    strict_ = true;
    std::size_t none = 1;
    while (none < waiting.size() && !starts_like_header(waiting.subspan(none))) ++none;
    // Bytes between messages are returned as they are, except after a gap, where they may be the rest of a message.
    if (!lost_) return cut(none);
    lose(none);
  }
  return std::nullopt;
}

void MessageSplitter::finish() { finished_ = true; }

namespace {

/// Returns the length of the message that begins here; 0 if none begins here, or if its end is missing.
std::size_t message_at_front(wire::BytesView bytes, const Framing& framing) {
  if (bytes.size() < std::max<std::size_t>(framing.header_size, 2)) return 0;
  if (bytes[0] != std::byte{framing.magic[0]} || bytes[1] != std::byte{framing.magic[1]}) return 0;
  if (framing.length == nullptr) {
    const auto end = std::find(bytes.begin(), bytes.end(), std::byte{'\n'});
    return end == bytes.end() ? 0 : static_cast<std::size_t>(end - bytes.begin()) + 1;
  }
  const std::size_t length = framing.length(bytes.first(framing.header_size), Origin::device, false).value_or(0);
  return length <= bytes.size() ? length : 0;
}

}  // namespace

std::size_t JunkReport::whole_messages(wire::BytesView bytes) const {
  std::size_t whole = 0;
  while (const std::size_t length = message_at_front(bytes.subspan(whole), *framing_)) whole += length;
  return whole;
}

void JunkReport::end(Damages& damages) {
  const std::uint64_t count = std::exchange(count_, 0);
  if (count > 0)
    damages.add((count == 1 ? "1 byte" : std::to_string(count) + " bytes") + " from " + place_ + " on belong to no message");
}

}  // namespace sonar::recording
