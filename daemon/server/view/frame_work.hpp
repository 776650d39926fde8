// Computes the work that the WebSocket frames of a viewer cause: each frame costs time in addition to its bytes. FrameWork parses
// the headers of frames itself, because the library reports neither empty fragments nor control frames (RFC 6455, 5.2). The
// bytes may arrive in any pieces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "daemon/server/connections/input_rate.hpp"

namespace sonar {

class FrameWork {
 public:
  /// Returns the work of the next bytes of the stream: their number, and a fixed amount for each frame that begins in them.
  std::size_t of(std::span<const std::byte> received) {
    std::size_t work = received.size();
    for (std::size_t i = 0; i < received.size();) {
      if (payload_left_ > 0) {
        const auto skipped = std::min<std::uint64_t>(payload_left_, received.size() - i);
        payload_left_ -= skipped;
        i += static_cast<std::size_t>(skipped);
        continue;
      }
      work += take(std::to_integer<std::uint8_t>(received[i++]));
    }
    return work;
  }

 private:
  /// Parses one byte of a frame header. Returns the fixed work of the frame if the byte is the first of the header, else 0.
  std::size_t take(std::uint8_t byte) {
    std::size_t work = 0;
    if (at_ == 0) {
      work = (byte & 0x08) != 0 ? work::of_control_frame : work::of_frame;
    } else if (at_ == 1) {
      length_ = byte & 0x7F;
      length_bytes_ = length_ == 126 ? 2 : length_ == 127 ? 8 : 0;
      mask_bytes_ = (byte & 0x80) != 0 ? 4 : 0;
      if (length_bytes_ > 0) length_ = 0;
    } else if (at_ < 2 + length_bytes_) {
      length_ = length_ << 8 | byte;
    }
    if (++at_ < 2 || at_ < 2 + length_bytes_ + mask_bytes_) return work;
    payload_left_ = length_;
    at_ = 0;
    return work;
  }

  std::size_t at_ = 0, length_bytes_ = 0, mask_bytes_ = 0;  // position in the header; sizes of its parts
  std::uint64_t length_ = 0, payload_left_ = 0;
};

}  // namespace sonar
