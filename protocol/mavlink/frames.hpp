// Finds and checks MAVLink frames (versions 1 and 2) in datagrams, and writes them. No field is used before the checksum is
// verified. protocol/mavlink/mavlink_poses.hpp converts messages to poses.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "protocol/mavlink/messages.hpp"

namespace sonar::mavlink {

inline constexpr std::size_t largest_payload = 255;

/// A frame with a valid checksum, of a message in known_messages().
struct Frame {
  int version = 2;
  std::uint8_t sequence = 0, system = 0, component = 0;
  std::uint32_t id = 0;
  std::size_t payload_size = 0;                      // sent size, which in version 2 excludes trailing zeros
  std::array<std::byte, largest_payload> payload{};  // with zeros after payload_size
};
/// Returns the message of a frame; M must be the type of that message.
template <class M>
M message_in(const Frame& frame) {
  M message;
  wire::Reader reader(frame.payload);
  all_fields(reader, message);
  return message;
}

struct FrameCounts {
  std::uint64_t frames = 0;        // valid frames
  std::uint64_t unknown = 0;       // frames with an unsupported message or flag, which are skipped
  std::uint64_t bad_checksum = 0;  // damaged frames, or a dialect that uses the number for another message
  std::uint64_t wrong_size = 0;    // frames of version 1 whose payload has a wrong length
  std::uint64_t junk_bytes = 0;    // bytes that belong to no frame
};

/// Reads the frames of one datagram, one after the other. `datagram` must outlive the reader.
class FrameReader {
 public:
  explicit FrameReader(BytesView datagram) : rest_(datagram) {}
  std::optional<Frame> next();
  const FrameCounts& counts() const { return counts_; }

 private:
  struct Header;
  std::optional<Header> header() const;
  std::optional<Frame> checked(const Header& header);
  bool begins_a_frame(std::size_t at) const;
  void skip(std::size_t count) { rest_ = rest_.subspan(count); }

  BytesView rest_;
  FrameCounts counts_;
};

/// Returns the CRC-16/MCRF4XX, which MAVLink calls X.25. `crc`: the checksum of earlier bytes, if there are any.
std::uint16_t checksum(BytesView bytes, std::uint16_t crc = 0xFFFF);

/// System, component and sequence number of a sender.
struct Identity {
  std::uint8_t system = 1, component = 0;
  std::uint8_t sequence = 0;  // sequence of the next frame
};
/// Makes a frame of version 2 with this payload. Increments the sender's sequence.
Bytes framed(std::uint32_t id, std::uint8_t crc_extra, BytesView payload, Identity& sender);
template <class M>
Bytes framed(const M& message, Identity& sender) {
  Bytes payload;
  wire::Writer writer(payload);
  all_fields(writer, message);
  return framed(M::id, M::crc_extra, payload, sender);
}

}  // namespace sonar::mavlink
