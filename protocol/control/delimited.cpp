#include "protocol/control/delimited.hpp"

namespace sonar::control {
namespace {
constexpr std::size_t longest_length_field = 5;  // bytes of a varint of 32 bits
}

Result<std::optional<std::vector<std::byte>>> DelimitedParser::next() {
  // Each call reads the length again until the whole message has arrived; the limit is checked before any memory is reserved.
  std::uint64_t length = 0;
  std::size_t used = 0;
  while (true) {
    if (used == longest_length_field)
      return failure(ErrorKind::bad_data, "control stream: the length in front of a message has more than 5 bytes");
    if (start_ + used == buffer_.size()) return std::optional<std::vector<std::byte>>{};
    const auto byte = std::to_integer<std::uint64_t>(buffer_[start_ + used]);
    length |= (byte & 0x7f) << (7 * used);
    ++used;
    if ((byte & 0x80) == 0) break;
  }
  if (length > most_)
    return failure(ErrorKind::bad_data, "control stream: a message of " + std::to_string(length) +
                                            " bytes exceeds the limit of " + std::to_string(most_));
  if (buffer_.size() - start_ - used < length) return std::optional<std::vector<std::byte>>{};
  const auto first = buffer_.begin() + static_cast<std::ptrdiff_t>(start_ + used);
  std::vector<std::byte> message(first, first + static_cast<std::ptrdiff_t>(length));
  start_ += used + static_cast<std::size_t>(length);
  // The front is erased rarely, so that many small messages do not move the rest each time.
  if (start_ == buffer_.size() || start_ > (64u << 10)) {
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(start_));
    start_ = 0;
  }
  return std::optional(std::move(message));
}

// protobuf's varint: 7 bits per byte, the lowest first; the top bit means that another byte follows.
std::vector<std::byte> delimited(std::span<const std::byte> message) {
  std::vector<std::byte> out;
  out.reserve(message.size() + longest_length_field);
  std::uint64_t rest = message.size();
  do {
    const auto low = static_cast<std::uint8_t>(rest & 0x7f);
    rest >>= 7;
    out.push_back(static_cast<std::byte>(rest != 0 ? low | 0x80u : low));
  } while (rest != 0);
  out.insert(out.end(), message.begin(), message.end());
  return out;
}

}  // namespace sonar::control
