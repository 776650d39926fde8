#include "protocol/recorded/junk_report.hpp"

#include <algorithm>
#include <utility>

namespace sonar::recording {
namespace {

/// Length of the message that begins here; 0 if none does, or if its end is missing.
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
