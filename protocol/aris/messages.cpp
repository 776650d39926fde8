#include "protocol/aris/messages.hpp"

namespace sonar::aris {

// The length prefix is big-endian, unlike all other numbers of the protocol (vendor's SDK).
Bytes framed(const Command& command) {
  const Bytes message = protobuf::bytes_of(command);
  Bytes out;
  const auto length = static_cast<std::uint32_t>(message.size());
  wire::Writer write(out, wire::Endian::big);
  write("length", length);
  out.insert(out.end(), message.begin(), message.end());
  return out;
}

void CommandFramer::append(BytesView received) {
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin_));
  begin_ = 0;
  if (!broken_) buffer_.insert(buffer_.end(), received.begin(), received.end());
}

// A message beyond the limit is not skipped, because its length may be up to 4 GiB.
std::optional<BytesView> CommandFramer::next() {
  const BytesView waiting = BytesView(buffer_).subspan(begin_);
  if (broken_ || waiting.size() < length_prefix) return std::nullopt;
  std::uint32_t length = 0;
  wire::Reader reader(waiting, wire::Endian::big);
  reader("length", length);
  if (length > longest_command) {
    broken_ = true;
    return std::nullopt;
  }
  if (waiting.size() - length_prefix < length) return std::nullopt;
  begin_ += length_prefix + length;
  return waiting.subspan(length_prefix, length);
}

}  // namespace sonar::aris
