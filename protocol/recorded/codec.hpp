// The part of a make that recordings need: its messages, and the file formats of its own programs. The other formats (captures,
// MCAP, raw dumps) hold messages of every make.
#pragma once

#include <algorithm>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/sonar/sonar_model.hpp"
#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/message_splitter.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar {
struct VendorSettings;
}

namespace sonar::recording {

inline bool begins_with(BytesView front, std::initializer_list<unsigned> bytes) {
  return front.size() >= bytes.size() && std::equal(bytes.begin(), bytes.end(), front.begin(),
                                                    [](unsigned a, std::byte b) { return a == std::to_integer<unsigned>(b); });
}

/// A file format of a make.
struct FileKind {
  std::string_view ending;              // extension, such as ".aris"
  std::string_view name;                // such as ".aris file"
  std::string_view holds;               // content, such as "frames of an ARIS"
  bool (*begins)(BytesView) = nullptr;  // true if a file with these first 16 bytes (fewer if the file is shorter) has this format
  Result<std::unique_ptr<RecordingReader>> (*read)(std::unique_ptr<Source>) = nullptr;
  std::unique_ptr<RecordingWriter> (*write)(std::unique_ptr<Sink>) = nullptr;
  bool is_raw_dump = false;  // true: a file of this format is a raw dump, and is read as one
};

/// The device that sent a message, as far as the message identifies it.
struct Sender {
  std::shared_ptr<const SonarModel> model;
  std::uint32_t serial = 0;  // 0: unknown
  bool names_model = true;   // false: the message states no model, and `model` is the first of the make
};

/// The samples of a message: row 0 nearest, column 0 farthest to port, little-endian.
struct Samples {
  std::size_t beams = 0, rows = 0;
  int bits = 8;
  std::shared_ptr<const Bytes> codes;
};

/// A message that holds a ping, or the part of a ping that one port sends.
struct PingPart {
  std::uint16_t port = 0;               // the sonar's port, if several ports send different parts of a ping; else 0
  std::optional<double> head_rad = {};  // direction of a mechanical scan, as protocol::RequestPing::head_rad
};

struct Codec {
  const Framing* framing = nullptr;  // framing of its TCP stream; null: messages have no delimiters
  std::span<const FileKind> files = {};
  /// Returns the sender of a device's message or datagram; nullopt for another make's message, or one that does not identify its
  /// sender.
  std::optional<Sender> (*sender)(const RecordedMessage&) = nullptr;
  /// Reads the samples of a message that contains a whole picture. Null: the make has no such message.
  std::optional<Samples> (*samples)(BytesView message) = nullptr;
  /// Converts the bytes of Vendor::frame() to the message that a client receives. Null: they are equal.
  Bytes (*message)(BytesView framed) = nullptr;
  /// Finds the ping, or the part of a ping, in a message; returns nullopt if there is none. If this function is set, a replay
  /// emulates the whole device with the recorded pings: drivers of the make must send requests or connect to several ports. Null:
  /// a replay sends the recorded messages to every driver.
  std::optional<PingPart> (*ping_part)(BytesView message) = nullptr;
  /// Converts a message that has a PingPart to the messages that Vendor::frame() or Vendor::datagrams() would make of a ping that
  /// was requested with `request`, in order. Null: the same bytes.
  std::vector<Bytes> (*answer)(BytesView message, const VendorSettings* request) = nullptr;
  /// True if a message that has a PingPart holds everything that another message of the same ping holds, and more. Null: no ping
  /// has two such messages.
  bool (*is_richer)(BytesView message, BytesView than) = nullptr;
  /// Returns the model with which a replay emulates the recorded sonar. Null: the recorded model.
  std::shared_ptr<const SonarModel> (*replayed)(const SonarModel& recorded) = nullptr;
};

}  // namespace sonar::recording
