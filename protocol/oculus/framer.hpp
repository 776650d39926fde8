// Splits a byte stream of either direction into whole messages. The stream may arrive in any pieces; junk is skipped byte by
// byte; memory is bounded. The Dialogue (device side) and the Decoder (driver side) use it.
#pragma once

#include <cstdint>
#include <optional>

#include "protocol/oculus/messages.hpp"

namespace sonar::oculus {

/// The sender of a stream. Some clients send payload_size 0 (docs/protocols/oculus.md, 2); devices send the true size.
enum class Sender { client, device };

/// Returns the total length of the message with this header; nullopt for a header that this sender never sends.
std::optional<std::size_t> message_length(const MessageHeader& header, Sender sender);

class Framer {
 public:
  explicit Framer(Sender sender) : sender_(sender) {}

  /// Adds received bytes. Before the next append, call next() until it returns nullopt, so that less than one message remains.
  void append(wire::BytesView received);
  /// Returns the next whole message, including the header; it is valid until the next call of append or next.
  std::optional<wire::BytesView> next();

  /// Returns the number of junk bytes skipped so far.
  std::uint64_t skipped_bytes() const { return skipped_; }
  std::size_t buffered_bytes() const { return buffer_.size() - begin_; }

 private:
  Sender sender_;
  wire::Bytes buffer_;
  std::size_t begin_ = 0;
  std::uint64_t skipped_ = 0;
};

/// Reads the header of a message of at least 16 bytes.
MessageHeader header_of(wire::BytesView message);

}  // namespace sonar::oculus
