// The part of a make that recordings need: its messages, and the kinds of files that its own programs read. The containers beside
// this file (captures, MCAP, raw dumps) hold messages of every make.
#pragma once

#include <algorithm>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "core/base/result.hpp"
#include "core/sonar/sonar_model.hpp"
#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/message_splitter.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar::recording {

inline bool begins_with(BytesView front, std::initializer_list<unsigned> bytes) {
  return front.size() >= bytes.size() && std::equal(bytes.begin(), bytes.end(), front.begin(),
                                                    [](unsigned a, std::byte b) { return a == std::to_integer<unsigned>(b); });
}

/// A kind of file of a make.
struct FileKind {
  std::string_view ending;              // ending of its names: ".aris"
  std::string_view name;                // ".aris file"
  std::string_view holds;               // "frames of an ARIS"
  bool (*begins)(BytesView) = nullptr;  // whether a file begins so; 16 bytes, fewer of a shorter file
  Result<std::unique_ptr<RecordingReader>> (*read)(std::unique_ptr<Source>) = nullptr;
  std::unique_ptr<RecordingWriter> (*write)(std::unique_ptr<Sink>) = nullptr;
  bool is_raw_dump = false;  // the same bytes as those of a raw dump, which it reads
};

/// The device that sent a message, as far as the message tells.
struct Sender {
  std::shared_ptr<const SonarModel> model;
  std::uint32_t serial = 0;  // 0: not known
  bool names_model = true;   // false: `model` is the first of the make, because this message names none
};

/// Samples as a message holds them: row 0 nearest, column 0 most to port, little-endian.
struct Samples {
  std::size_t beams = 0, rows = 0;
  int bits = 8;
  std::shared_ptr<const Bytes> codes;
};

struct Codec {
  const Framing* framing = nullptr;  // framing of its TCP stream; null: nothing tells messages apart
  std::span<const FileKind> files = {};
  /// Finds the sender of a device's message or datagram; nullopt: it is another make's, or does not name its sender.
  std::optional<Sender> (*sender)(const RecordedMessage&) = nullptr;
  /// Reads the samples of a message that holds them as a picture has them. Null: this make has no such message.
  std::optional<Samples> (*samples)(BytesView message) = nullptr;
  /// A message as a client gets it of what Vendor::frame() makes of a ping. Null: the same bytes.
  Bytes (*message)(BytesView framed) = nullptr;
};

}  // namespace sonar::recording
