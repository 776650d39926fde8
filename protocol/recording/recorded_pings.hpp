// Reads the pings of a recording, decoded by the host of their make. Used by `sonarctl` and by the live view.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "protocol/recording/recording.hpp"

namespace sonar::recording {

struct RecordedPing {
  Time at{};  // 0 if the format stores no times
  protocol::HostPing ping;
};

/// The pings that `host`, a host of `make`, decodes from the next message of a recording. Null: the recording has ended, so pings
/// that wait for another part are complete. Actions of the host other than pings are left out.
std::vector<RecordedPing> decode_next(protocol::Host& host, const protocol::Make& make, const RecordedMessage* message);

class RecordedPings {
 public:
  /// Errors: bad_data if the recording contains no ping of a known sonar.
  static Result<RecordedPings> open(std::unique_ptr<RecordingReader> reader);

  /// nullopt at the end.
  std::optional<RecordedPing> next();
  void rewind();
  const SentBy& by() const { return by_; }
  const RecordingReader& reader() const { return *reader_; }

 private:
  RecordedPings(std::unique_ptr<RecordingReader> reader, SentBy by) : reader_(std::move(reader)), by_(std::move(by)) {}
  Result<void> make_host();

  std::unique_ptr<RecordingReader> reader_;
  SentBy by_;
  std::unique_ptr<protocol::Host> host_;
  std::deque<RecordedPing> decoded_;  // pings of the last message that next() has not returned yet
};

}  // namespace sonar::recording
