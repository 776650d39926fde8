// Finds bytes of a recording that belong to no message.
#pragma once

#include <string>

#include "protocol/recorded/message_splitter.hpp"

namespace sonar::recording {

/// Takes the stream of a device in order, and reports each run of bytes outside messages as one damage.
class JunkReport {
 public:
  /// `framing` must outlive it. Null: the stream has no boundaries, so nothing is reported.
  explicit JunkReport(const Framing* framing) : framing_(framing) {}

  /// Takes the next messages, or bytes between messages. `place` returns "byte 17", the place of these bytes.
  template <class Place>
  void take(wire::BytesView bytes, const Place& place, Damages& damages) {
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

}  // namespace sonar::recording
