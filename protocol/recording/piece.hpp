// What a recording is made of: pieces of what a sonar and its client sent each other, in the order and at the times they came.
// Readers of every format give them, writers take them; replay sends them out again.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/result.hpp"
#include "core/base/units.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::recording {

enum class Origin { device, client };
enum class Carrier { stream, datagram };  // TCP; UDP (status)

/// A whole message, or bytes between messages that are none. Never part of a message.
struct Piece {
  Time at{};  // of its last byte
  Origin from = Origin::device;
  Carrier by = Carrier::stream;
  wire::Bytes bytes;
};

/// Reads a recording front to back, with bounded memory. What is readable is given, also behind a damaged place.
class PieceReader {
 public:
  virtual ~PieceReader() = default;
  /// Nothing at the end.
  virtual std::optional<Piece> next() = 0;
  /// What could not be read so far, and where: one sentence, of kind bad_data. Complete at the end.
  virtual std::optional<Error> damage() const = 0;
  /// From the front again; forgets the damage.
  virtual void rewind() = 0;
  /// False when the format knows no times: all are 0.
  virtual bool knows_times() const { return true; }
  /// What of the recording is left aside, if anything: other sonars in the same file.
  virtual std::string note() const { return {}; }
};

class PieceWriter {
 public:
  virtual ~PieceWriter() = default;
  /// Times never fall. After an error (io) the file stays as it was before this piece, and nothing more is written.
  virtual Result<void> write(const Piece& piece) = 0;
  /// Finishes and closes the file. io.
  virtual Result<void> close() = 0;
};

/// Remembers the first damage and counts the others.
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
    const std::string others = count_ == 1 ? "" : "; " + std::to_string(count_ - 1) + " more such places";
    return Error{ErrorKind::bad_data, file + ": " + first_ + others};
  }

 private:
  std::uint64_t count_ = 0;
  std::string first_;
};

}  // namespace sonar::recording
