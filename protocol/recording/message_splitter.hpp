// Splits the bytes of one direction of an Oculus connection into whole messages and the bytes between them; no byte is lost.
// Used on raw dumps, captures and live sockets.
#pragma once

#include <optional>

#include "protocol/oculus/framer.hpp"
#include "protocol/recording/recorded_message.hpp"

namespace sonar::recording {

class MessageSplitter {
 public:
  explicit MessageSplitter(Origin from) : from_(from) {}

  /// Drain with next() before the next append: less than one message then remains.
  void append(Time at, wire::BytesView bytes);
  /// Reports missing bytes: the incomplete message and all bytes up to the next header are lost.
  void break_off();
  std::optional<RecordedMessage> next();
  /// Ends the stream. next() returns remaining bytes that do not begin a message; an incomplete message is lost.
  void finish();

  /// Bytes of incomplete messages, and the number of such places.
  std::uint64_t lost_bytes() const { return lost_bytes_; }
  std::uint64_t losses() const { return losses_; }
  /// Of the unfinished message: bytes that are there.
  std::size_t waiting_bytes() const { return buffer_.size() - begin_; }

 private:
  std::optional<std::size_t> length_at_front(wire::BytesView waiting) const;
  RecordedMessage cut(std::size_t count);
  void lose(std::size_t count);

  Origin from_;
  Time at_{};
  wire::Bytes buffer_;
  std::size_t begin_ = 0;
  bool lost_ = false, strict_ = false, finished_ = false;
  std::uint64_t lost_bytes_ = 0, losses_ = 0;
};

/// True for headers of the message types that are known.
bool is_known(const oculus::MessageHeader& header);

}  // namespace sonar::recording
