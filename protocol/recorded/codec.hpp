// The part of a make that recordings need: its messages, and the kinds of files that its own programs read. The containers beside
// this file (captures, MCAP, raw dumps) hold messages of every make.
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

/// The device that sent a message, as far as the message identifies it.
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

/// A message that holds a ping, or the part of a ping that one port sends.
struct PingPart {
  std::uint16_t port = 0;               // the sonar's port, if each of several sends parts of its own; else 0
  std::optional<double> head_rad = {};  // direction of a mechanical scan, as protocol::RequestPing::head_rad
};

struct Codec {
  const Framing* framing = nullptr;  // framing of its TCP stream; null: nothing delimits messages
  std::span<const FileKind> files = {};
  /// Finds the sender of a device's message or datagram; nullopt: it is another make's, or does not name its sender.
  std::optional<Sender> (*sender)(const RecordedMessage&) = nullptr;
  /// Reads the samples of a message that holds them as a picture has them. Null: this make has no such message.
  std::optional<Samples> (*samples)(BytesView message) = nullptr;
  /// A message as a client gets it of what Vendor::frame() makes of a ping. Null: the same bytes.
  Bytes (*message)(BytesView framed) = nullptr;
  /// Set if requests of hosts decide which pings they get, or if pings come by several ports: then a replay is a whole device,
  /// whose pings these are. nullopt: the message is not of a ping. A part of a ping may be a message of its own.
  std::optional<PingPart> (*ping_part)(BytesView message) = nullptr;
  /// A message of ping_part() as the messages that Vendor::frame() or Vendor::datagrams() makes of a ping that was requested with
  /// `request`, in order. Null: the same bytes.
  std::vector<Bytes> (*answer)(BytesView message, const VendorSettings* request) = nullptr;
};

}  // namespace sonar::recording
