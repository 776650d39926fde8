// Cuts the bytes of one direction of an Oculus connection into pieces: whole messages, and what lies between them, byte for byte.
// Stands between streams (raw dumps, captures, live sockets) and everything that keeps or replays messages.
#pragma once

#include <optional>

#include "protocol/oculus/framer.hpp"
#include "protocol/recording/piece.hpp"

namespace sonar::recording {

class MessageSplitter {
 public:
  explicit MessageSplitter(Origin from) : from_(from) {}

  /// Drain with next() before the following append: what then stays is less than one message.
  void append(Time at, wire::BytesView bytes);
  /// Bytes are missing before what comes next: a message that was begun is lost, and so is all up to the next header.
  void break_off();
  std::optional<Piece> next();
  /// The stream is over. What is no beginning of a message is given by next(), the rest is lost.
  void finish();

  /// Bytes of messages whose other parts are missing, and how many such places there were.
  std::uint64_t lost_bytes() const { return lost_bytes_; }
  std::uint64_t losses() const { return losses_; }
  /// Of the unfinished message: bytes that are there.
  std::size_t waiting_bytes() const { return buffer_.size() - begin_; }

 private:
  std::optional<std::size_t> length_at_front(wire::BytesView waiting) const;
  Piece take(std::size_t count);
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
