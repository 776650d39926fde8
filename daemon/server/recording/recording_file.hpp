// One file that the daemon records: the messages of a sonar, and in MCAP also pictures, true poses and the first hit of each
// beam. The writer thread creates and writes the file (recordings.hpp).
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/sonar/ping.hpp"
#include "protocol/host.hpp"
#include "protocol/recording/mcap/mcap_session.hpp"
#include "protocol/recording/pcap/pcap.hpp"
#include "protocol/vendor.hpp"

namespace sonar {

using recording::mcap::SceneNames;

/// A ping to be written. It shares its large parts with the clients to which the ping was sent.
struct RecordedPing {
  Time at{};  // time at which the ping was made
  std::shared_ptr<const Ping> ping;
  std::shared_ptr<const protocol::Bytes> bytes;  // the message that clients get; null = not sent over TCP
  std::vector<std::shared_ptr<const std::vector<protocol::Bytes>>> datagrams;  // datagrams of each stream, as receivers get them
  protocol::Bytes status;                                                      // status message then; empty = none
  std::shared_ptr<const SceneNames> names;                                     // names of objects and bodies in the ping's scene

  /// Returns the bytes of memory that the ping needs while it waits.
  std::size_t size() const;
};

/// The properties of a sonar that a recording needs.
struct RecordedSonar {
  std::string name, vendor;
  recording::PcapConversation ends;  // for the headers of a capture
  bool has_range_images = false;     // range images have no labels
  std::string profile = {};          // profile of the sonar; empty = unknown
};

class RecordingFile {
 public:
  /// One of the three below, or a row of a make's Codec::files.
  using Kind = const recording::FileKind*;
  static const recording::FileKind mcap, pcap, raw_dump;

  /// True if `name` is a plain file name: at most 128 letters, digits, - _ and . , not beginning with a dot.
  static bool is_plain_name(std::string_view name);
  /// True if `name` is a plain file name with the extension of a recording.
  static bool is_recording(std::string_view name);
  /// True if the file, after following symbolic links, lies in the folder.
  static bool is_inside(const std::filesystem::path& folder, const std::filesystem::path& file);
  /// Returns the format for the extension of a plain file name: .mcap, an extension of this vendor or, if pings are sent as a
  /// stream, .pcap or .raw. Other names are errors.
  static Result<Kind> kind_of(std::string_view name, std::string_view vendor);
  /// Creates the file. `labels`: also write the labels of pings, in MCAP. Errors: io, also if the file exists, which is then not
  /// changed.
  static Result<std::unique_ptr<RecordingFile>> create(const std::filesystem::path& file, Kind kind, const RecordedSonar& sonar,
                                                       bool labels = false);

  RecordingFile(std::unique_ptr<recording::Sink> sink, Kind kind, const RecordedSonar& sonar, bool labels = false);

  /// Writes a ping, and before it a status message if the last one is a second old. After an error (io) only close() may be
  /// called.
  Result<void> write(const RecordedPing& ping);
  /// Writes a FaultEntry of control.proto, in JSON, to an MCAP file; other formats ignore it. Errors: io.
  Result<void> write_fault(Time at, const std::string& json) {
    return mcap_ == nullptr ? Result<void>{} : mcap_->write_fault(at, json);
  }
  /// Completes the file; after an error, as far as possible. Errors: io.
  Result<void> close() { return writer_->close(); }

  struct Figures {
    std::uint64_t pings = 0, messages = 0, bytes = 0;  // messages of the sonar; bytes of the file so far
  };
  Figures figures() const { return {pings_, messages_, *bytes_}; }

 private:
  Result<void> put(recording::RecordedMessage message);
  Result<void> put_truth(const RecordedPing& ping);

  Kind kind_;
  const protocol::Make* make_;
  bool labels_;
  std::shared_ptr<std::uint64_t> bytes_ = std::make_shared<std::uint64_t>(0);
  std::unique_ptr<recording::RecordingWriter> writer_;
  recording::McapSession* mcap_ = nullptr;  // equals writer_ if that is a McapSession
  std::optional<Time> status_at_;
  std::uint64_t pings_ = 0, messages_ = 0;
};

}  // namespace sonar
