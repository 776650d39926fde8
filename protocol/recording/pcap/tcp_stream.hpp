// Reassembles one direction of a TCP connection: drops retransmitted bytes, holds early segments, reports lost segments. Third
// step of reading a capture; its output goes to a MessageSplitter.
#pragma once

#include <deque>
#include <map>
#include <optional>

#include "core/base/units.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::recording {

class TcpStream {
 public:
  static constexpr std::size_t most_waiting_bytes = 8u << 20;  // early segments; beyond this the missing bytes count as lost
  static constexpr std::size_t most_waiting = 8192;

  struct Run {
    Time at{};
    wire::Bytes bytes;
    std::uint64_t missing_before = 0;  // bytes that the capture lacks here
    bool from_middle = false;          // true: the capture began after the start of the connection
  };

  /// Adds a segment. `sequence`: the sequence number of its first byte or, in a SYN, of the SYN.
  void add(Time at, std::uint32_t sequence, wire::BytesView payload, bool syn);
  /// Ends the connection or the capture: releases held segments.
  void finish();
  std::optional<Run> next();
  /// Returns the memory of early segments, including overhead.
  std::size_t held_bytes() const { return waiting_bytes_ + waiting_.size() * 128; }
  /// True if a SYN with this number begins another connection.
  bool is_other(std::uint32_t syn_sequence) const { return begun_ && (!saw_syn_ || first_ != syn_sequence + 1); }

 private:
  struct Early {
    Time at{};
    wire::Bytes bytes;
  };
  void begin(std::uint32_t sequence, bool syn);
  void give(Time at, wire::BytesView bytes);
  void give_what_follows();
  void skip_to_first_waiting();

  bool begun_ = false, saw_syn_ = false, from_middle_ = false;
  std::uint32_t first_ = 0;     // sequence number of the first byte
  std::uint64_t position_ = 0;  // position of the next byte, counted from the first
  std::uint64_t missing_ = 0;
  std::map<std::uint64_t, Early> waiting_;
  std::size_t waiting_bytes_ = 0;
  std::deque<Run> ready_;
};

}  // namespace sonar::recording
