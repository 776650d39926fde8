// One file of a recording inside the daemon: what a sonar sends, and in MCAP also pictures, true poses and what each beam meets.
// Made and written on the recording thread (recordings.hpp); it has no queue, no clock and no log.
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

/// A ping on its way into files. What is large is shared with the clients that it was sent to.
struct RecordedPing {
  Time at{};  // when it was made
  std::shared_ptr<const Ping> ping;
  std::shared_ptr<const protocol::Bytes> bytes;  // the vendor's, as clients get them; null = not sent over TCP
  std::vector<std::shared_ptr<const std::vector<protocol::Bytes>>> datagrams;  // datagrams of each stream, as receivers get them
  protocol::Bytes status;                   // status that the sonar announced then; empty = none
  std::shared_ptr<const SceneNames> names;  // names of the scene in which it was made

  /// Bytes that it keeps in memory while it waits.
  std::size_t size() const;
};

/// A sonar as recordings name it.
struct RecordedSonar {
  std::string name, vendor;
  recording::PcapConversation ends;  // for the headers of a capture
  bool has_range_images = false;     // range images have no labels
};

class RecordingFile {
 public:
  /// One of the three below, or a row of a make's Codec::files.
  using Kind = const recording::FileKind*;
  static const recording::FileKind mcap, pcap, raw_dump;

  /// Whether it is the name of a file in a folder: letters, digits, - _ and . that does not begin it, at most 128.
  static bool is_plain_name(std::string_view name);
  /// Whether its end is that of recordings too.
  static bool is_recording(std::string_view name);
  /// Kind of a file's name: letters, digits, - _ and . that does not begin it, at most 128, ending in .mcap or as files of this
  /// vendor do; for one whose pings are a stream also in .pcap or .raw. An error for another name.
  static Result<Kind> kind_of(std::string_view name, std::string_view vendor);
  /// `labels`: in MCAP, of pings that have them. io; a file that is there already is not touched.
  static Result<std::unique_ptr<RecordingFile>> create(const std::filesystem::path& file, Kind kind, const RecordedSonar& sonar,
                                                       bool labels = false);

  RecordingFile(std::unique_ptr<recording::Sink> sink, Kind kind, const RecordedSonar& sonar, bool labels = false);

  /// A status message goes before it when the last one is a second old. After an error (io) only close() makes sense.
  Result<void> write(const RecordedPing& ping);
  /// A FaultEntry of control.proto, in JSON; files other than MCAP leave it out. io.
  Result<void> write_fault(Time at, const std::string& json) {
    return mcap_ == nullptr ? Result<void>{} : mcap_->write_fault(at, json);
  }
  /// Finishes the file, after an error too, as far as that goes. io.
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
  recording::McapSession* mcap_ = nullptr;  // the writer, when it is one
  std::optional<Time> status_at_;
  std::uint64_t pings_ = 0, messages_ = 0;
};

}  // namespace sonar
