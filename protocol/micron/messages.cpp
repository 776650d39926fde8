#include "protocol/micron/messages.hpp"

#include <algorithm>

#include "core/text/format.hpp"

namespace sonar::micron {
namespace {

/// Returns the length as four hexadecimal digits in upper case, which all public drivers expect.
std::array<std::uint8_t, 4> digits_of(std::uint16_t length) {
  const std::string text = text::format("%04X", static_cast<unsigned>(length));
  std::array<std::uint8_t, 4> digits{};
  std::copy_n(text.begin(), digits.size(), digits.begin());
  return digits;
}

/// Returns whether the public drivers list a message with this id.
bool is_known(Id id) {
  switch (id) {
    case Id::version_data:
    case Id::head_data:
    case Id::alive:
    case Id::user_data:
    case Id::reboot:
    case Id::head_command:
    case Id::send_version:
    case Id::send_user:
    case Id::send_data:
    case Id::fpga_version_data:
    case Id::fpga_calibration_data:
    case Id::stop_alives:
      return true;
  }
  return false;
}

/// Returns the length of the frame with this header. A frame states its length twice, as digits and as a number. Both must agree,
/// so that bytes of an image are seldom mistaken for the start of a frame.
std::optional<std::size_t> length_of(BytesView bytes, recording::Origin, bool strict) {
  const auto header = read_front<Header>(bytes);
  if (!header || header->hex_length != digits_of(header->length) || (strict && !is_known(header->id))) return std::nullopt;
  const std::size_t size = header->length + uncounted;
  return size >= frame_size && size <= longest_frame ? std::optional(size) : std::nullopt;
}

}  // namespace

// A length is at most longest_frame - uncounted = 0x0FFA, so its first digit is 0.
const recording::Framing framing{{'@', '0'}, header_size, length_of};

Bytes framed(Id id, std::uint8_t source, std::uint8_t destination, BytesView payload) {
  const auto length = static_cast<std::uint16_t>(payload.size() + frame_size - uncounted);
  Header header{.hex_length = digits_of(length), .length = length, .source = source, .destination = destination, .id = id};
  header.count = id == Id::head_data ? 0 : static_cast<std::uint8_t>(length - 5);  // MCG: 0 in head data that is not split
  header.node = source == host_node ? destination : source;
  Bytes frame = wire::bytes_of(header);
  frame.insert(frame.end(), payload.begin(), payload.end());
  frame.push_back(std::byte{line_feed});
  return frame;
}

std::optional<Message> read_frame(BytesView frame) {
  const auto size = frame.size() >= frame_size && frame.front() == std::byte{'@'}
                        ? length_of(frame.first(header_size), recording::Origin::device, false)
                        : std::nullopt;
  if (size != frame.size() || frame.back() != std::byte{line_feed}) return std::nullopt;
  return Message{*read_front<Header>(frame), frame.subspan(header_size, frame.size() - frame_size)};
}

Bytes packed(BytesView bins, bool upper_first) {
  Bytes bytes((bins.size() + 1) / 2);
  for (std::size_t i = 0; i < bins.size(); ++i) bytes[i / 2] |= (i % 2 == 0) == upper_first ? bins[i] << 4 : bins[i];
  return bytes;
}

// The upper half of a byte is assumed to be the nearer bin, because the frame does not state the order (option first_4bit_bin).
Bytes unpacked(BytesView bytes) {
  Bytes bins;
  for (const std::byte both : bytes) bins.insert(bins.end(), {both >> 4, both & std::byte{15}});
  return bins;
}

}  // namespace sonar::micron
