// Opens recordings of any format, recognised by their first bytes: captures (pcap, pcapng), MCAP, a make's own format, raw dumps.
// `sonard replay`, the live view and `sonarctl --from` use it.
#pragma once

#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"
#include "protocol/sender.hpp"

namespace sonar::recording {

/// Returns the extensions of all supported files, such as ".pcap, .mcap, .raw, .oculus".
std::string file_endings();

struct Recording {
  std::string_view format;  // such as ".oculus log", "MCAP" or "capture"
  std::unique_ptr<RecordingReader> reader;
};
/// Opens a recording. `sonar` selects one of several sonars, by IPv4 address in captures, by name in MCAP; empty = the one that
/// read_pcap() selects, or the first. Errors: missing_file, io, bad_data; usage if a file of this format cannot name such a
/// sonar.
Result<Recording> open_recording(const std::filesystem::path& file, const std::string& sonar = {});
Result<Recording> open_recording(std::unique_ptr<Source> source, const std::string& sonar = {});

/// Finds the sonar of a recording within the first 64 MB, from the first message that states its model, or else from its first
/// message and the profile that the file states. Rewinds the reader.
std::optional<SentBy> find_sender(RecordingReader& reader);

// Reads the pings of a recording, which the host of their make decodes, for `sonarctl` and the live view.

struct RecordedPing {
  Time at{};  // time of the ping; 0 if the format stores no times
  protocol::HostPing ping;
};

/// Returns the pings that `host`, a host of `make`, decodes from the next message of a recording. `message` null: the recording
/// has ended, so pings that wait for another part are complete. Other actions of the host are ignored.
std::vector<RecordedPing> decode_next(protocol::Host& host, const protocol::Make& make, const RecordedMessage* message);

class RecordedPings {
 public:
  /// Opens the pings. Errors: bad_data if the recording contains no ping of a known sonar.
  static Result<RecordedPings> open(std::unique_ptr<RecordingReader> reader);

  /// Returns the next ping; nullopt at the end.
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
