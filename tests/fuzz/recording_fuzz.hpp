// Properties of every reader of recordings, for any file: it ends, no message exceeds the maximum size, and a second reading
// gives the same messages.
#pragma once

#include <cstdlib>

#include "protocol/recording/recording.hpp"

namespace sonar::fuzz {

inline recording::Bytes bytes_from(const std::uint8_t* data, std::size_t size) {
  recording::Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(data[i]);
  return bytes;
}

struct ReadThrough {
  std::uint64_t messages = 0, bytes = 0;
  bool damaged = false;
  bool operator==(const ReadThrough&) const = default;
};
/// Reads to the end; the reader may return at most `most_bytes`.
inline ReadThrough read_through(recording::RecordingReader& reader, std::uint64_t most_bytes) {
  ReadThrough read;
  while (const auto message = reader.next()) {
    ++read.messages;
    read.bytes += message->bytes.size();
    if (message->bytes.empty() || read.bytes > most_bytes) std::abort();
  }
  read.damaged = reader.damage().has_value();
  if (reader.next()) std::abort();
  return read;
}

inline void check_reader(Result<std::unique_ptr<recording::RecordingReader>> reader, std::uint64_t most_bytes) {
  if (!reader) {
    if (reader.error().text.empty()) std::abort();
    return;
  }
  const ReadThrough first = read_through(**reader, most_bytes);
  (*reader)->rewind();
  if (read_through(**reader, most_bytes) != first) std::abort();
}

}  // namespace sonar::fuzz
