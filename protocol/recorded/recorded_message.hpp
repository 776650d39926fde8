// The unit of a recording: one message between a sonar and its client, with its time and direction. The readers of every format
// return such messages, the writers accept them, and replay sends them again.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/result.hpp"
#include "core/base/units.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::recording {

enum class Origin { device, client };
enum class Carrier { stream, datagram };  // TCP; UDP

/// A whole message, or bytes between messages; never a part of a message.
struct RecordedMessage {
  Time at{};  // time of its last byte
  Origin from = Origin::device;
  Carrier by = Carrier::stream;
  wire::Bytes bytes;
};

/// Reads a recording from start to end with bounded memory. It continues after damage.
class RecordingReader {
 public:
  virtual ~RecordingReader() = default;
  /// Returns the next message; nullopt at the end.
  virtual std::optional<RecordedMessage> next() = 0;
  /// Returns an error of kind bad_data whose text names the first damage and counts further ones. It is complete once next() has
  /// returned nullopt.
  virtual std::optional<Error> damage() const = 0;
  /// Starts again at the beginning and clears the damage.
  virtual void rewind() = 0;
  /// False if the format stores no times; all times are then 0.
  virtual bool knows_times() const { return true; }
  /// Returns the profile of the sonar, such as "oculus-m1200d", if the file states it; else empty. It is known once next() has
  /// returned a message.
  virtual std::string profile() const { return {}; }
  /// Returns a text about the parts of the recording that were skipped, such as other sonars in the same file; empty if nothing
  /// was skipped.
  virtual std::string note() const { return {}; }
};

class RecordingWriter {
 public:
  virtual ~RecordingWriter() = default;
  /// Writes a message. Times must not decrease. After an error (io) the file does not contain this message, and later calls write
  /// nothing.
  virtual Result<void> write(const RecordedMessage& message) = 0;
  /// Finishes and closes the file. Errors are of kind io.
  virtual Result<void> close() = 0;
};

/// Stores the first damage and counts further ones.
class Damages {
 public:
  void add(std::string where_and_what) {
    if (count_++ == 0) first_ = std::move(where_and_what);
  }
  void add(const Damages& others) {
    if (count_ == 0) first_ = others.first_;
    count_ += others.count_;
  }
  void clear() { *this = {}; }
  bool any() const { return count_ > 0; }
  const std::string& first() const { return first_; }
  std::optional<Error> error(const std::string& file) const {
    if (count_ == 0) return std::nullopt;
    const std::string others =
        count_ == 1 ? "" : "; " + std::to_string(count_ - 1) + (count_ == 2 ? " more such place" : " more such places");
    return Error{ErrorKind::bad_data, file + ": " + first_ + others};
  }

 private:
  std::uint64_t count_ = 0;
  std::string first_;
};

}  // namespace sonar::recording
