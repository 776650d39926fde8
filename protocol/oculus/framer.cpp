#include "protocol/oculus/framer.hpp"

namespace sonar::oculus {
namespace {

/// Returns the length of a client's message that states a payload size of 0.
std::size_t natural_length(const MessageHeader& header) {
  switch (header.type) {
    case MessageType::fire:
      return header.version >= 2 ? fire_v2_size : fire_v1_size;
    case MessageType::user_config:
      return user_config_size;
    default:
      return header_size;
  }
}

constexpr std::byte first_magic{magic & 0xFF}, second_magic{magic >> 8};

}  // namespace

MessageHeader header_of(wire::BytesView message) {
  MessageHeader header;
  wire::Reader reader(message);
  fields(reader, header);
  return header;
}

std::optional<std::size_t> message_length(const MessageHeader& header, Sender sender) {
  if (header.oculus_id != magic) return std::nullopt;
  if (sender == Sender::device) {
    if (header.payload_size > reply_limit - header_size) return std::nullopt;
    return header_size + header.payload_size;
  }
  // VND, BAS, MRG, TID and ALD send payload size 0 before 37 bytes of payload, so 0 means the natural length of the type.
  if (header.payload_size > request_payload_limit) return std::nullopt;
  return header.payload_size == 0 ? natural_length(header) : header_size + header.payload_size;
}

void Framer::append(wire::BytesView received) {
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin_));
  begin_ = 0;
  buffer_.insert(buffer_.end(), received.begin(), received.end());
}

std::optional<wire::BytesView> Framer::next() {
  while (buffered_bytes() > 0) {
    const auto waiting = wire::BytesView(buffer_).subspan(begin_);
    const bool starts_like_header = waiting[0] == first_magic && (waiting.size() < 2 || waiting[1] == second_magic);
    // These bytes may be the start of a header; its rest has not arrived.
    if (starts_like_header && waiting.size() < header_size) return std::nullopt;
    const auto length = starts_like_header ? message_length(header_of(waiting), sender_) : std::nullopt;
    if (length) {
      if (waiting.size() < *length) return std::nullopt;
      begin_ += *length;
      return waiting.first(*length);
    }
    // Only one byte is skipped, because a header may begin at the next byte.
    ++begin_;
    ++skipped_;
  }
  return std::nullopt;
}

}  // namespace sonar::oculus
