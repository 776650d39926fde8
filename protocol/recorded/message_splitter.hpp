// Splits the bytes of one direction of a connection into whole messages and the bytes between them; no byte is lost.
// Used on raw dumps, captures and live sockets.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar::recording {

/// The boundaries of messages in a make's stream.
struct Framing {
  std::array<std::uint8_t, 2> magic{};  // first bytes of every message
  std::size_t header_size = 0;
  /// Returns the total length of the message with this header; nullopt if the bytes are not a header. `strict`: unknown types are
  /// not headers either.
  std::optional<std::size_t> (*length)(wire::BytesView header, Origin from, bool strict) = nullptr;  // null: messages are lines

  /// True if `bytes` begin with a header of a known type.
  bool begins_message(wire::BytesView bytes, Origin from) const;
};

class MessageSplitter {
 public:
  /// `framing` must outlive the object.
  MessageSplitter(Origin from, const Framing& framing) : from_(from), framing_(&framing) {}

  /// Before the next append(), call next() until it returns nullopt, so that less than one message remains.
  void append(Time at, wire::BytesView bytes);
  /// Call it where bytes are missing. The incomplete message and all bytes up to the next header are then lost.
  void break_off();
  std::optional<RecordedMessage> next();
  /// Ends the stream. next() returns remaining bytes that do not begin a message; an incomplete message is lost.
  void finish();

  /// Return the number of bytes of incomplete messages, and the number of such places.
  std::uint64_t lost_bytes() const { return lost_bytes_; }
  std::uint64_t losses() const { return losses_; }
  /// Returns the number of received bytes of the incomplete message.
  std::size_t waiting_bytes() const { return buffer_.size() - begin_; }

 private:
  bool starts_like_header(wire::BytesView bytes) const;
  std::optional<std::size_t> length_at_front(wire::BytesView waiting) const;
  RecordedMessage cut(std::size_t count);
  void lose(std::size_t count);

  Origin from_;
  const Framing* framing_;
  Time at_{};
  wire::Bytes buffer_;
  std::size_t begin_ = 0;
  bool lost_ = false, strict_ = false, finished_ = false;
  std::uint64_t lost_bytes_ = 0, losses_ = 0;
};

// Finds bytes of a recording that belong to no message.

/// Reads the stream of a device in order, and reports each run of bytes outside messages as one damage.
class JunkReport {
 public:
  /// `framing` must outlive the object. Null: the stream has no boundaries, so nothing is reported.
  explicit JunkReport(const Framing* framing) : framing_(framing) {}

  /// Reads the next messages, or bytes between messages. `place` returns "byte 17", the place of these bytes.
  void take(wire::BytesView bytes, const auto& place, Damages& damages) {
    if (framing_ == nullptr) return;
    const std::size_t whole = whole_messages(bytes);
    if (whole > 0) end(damages);
    if (count_ == 0 && whole < bytes.size()) place_ = place();
    count_ += bytes.size() - whole;
  }
  /// Reports the last run.
  void end(Damages& damages);

 private:
  std::size_t whole_messages(wire::BytesView bytes) const;

  const Framing* framing_;
  std::uint64_t count_ = 0;
  std::string place_;
};

// The plain byte stream of a device: successive messages without times (docs/recording.md).

/// Reads a raw dump. Errors: bad_data if the source does not begin with a message of this framing. `framing` must outlive the
/// reader.
Result<std::unique_ptr<RecordingReader>> read_raw_dump(std::unique_ptr<Source> source, const Framing& framing);
/// Writes all bytes that the device sent with the carrier `by`, and nothing else.
std::unique_ptr<RecordingWriter> write_raw_dump(std::unique_ptr<Sink> sink, Carrier by = Carrier::stream);

}  // namespace sonar::recording
