// Framing of the control stream: a varint length, then that many bytes. Incremental and without I/O: the stream may arrive in
// any pieces. Source: protobuf encoding guide, "varint"; the limit of the length is ours (control.proto).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/result.hpp"

namespace sonar::control {

class DelimitedParser {
 public:
  static constexpr std::size_t largest_message = 1u << 20;

  /// `most`: bytes of a message, at most largest_message.
  explicit DelimitedParser(std::size_t most = largest_message) : most_(std::min(most, largest_message)) {}
  void feed(std::span<const std::byte> received) { buffer_.insert(buffer_.end(), received.begin(), received.end()); }
  /// The next whole message; nullopt if more bytes are needed. After an error the rest of the stream cannot be read.
  Result<std::optional<std::vector<std::byte>>> next();

 private:
  std::size_t most_;
  std::vector<std::byte> buffer_;  // never longer than one message and one read
  std::size_t start_ = 0;          // start of the next message
};

/// Length and message, ready to be sent.
std::vector<std::byte> delimited(std::span<const std::byte> message);

}  // namespace sonar::control
