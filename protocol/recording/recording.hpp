// Opens recordings of any format, recognised by their first bytes: captures (pcap, pcapng), MCAP, a make's own format, raw
// dumps. Used by `sonard replay`, the live view, and `sonarctl` for --from.
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "protocol/recorded/byte_source.hpp"
#include "protocol/recorded/recorded_message.hpp"
#include "protocol/sender.hpp"

namespace sonar::recording {

/// The extensions of all supported files, such as ".pcap, .mcap, .raw, .oculus".
std::string file_endings();

struct Recording {
  std::string_view format;  // ".oculus log", "MCAP", "capture"
  std::unique_ptr<RecordingReader> reader;
};
/// `sonar`: selects one of several, by IPv4 address in captures, by name in MCAP; empty = the one with most bytes, or the first.
/// Errors: missing_file, io, bad_data; usage if a file of this format cannot name such a sonar.
Result<Recording> open_recording(const std::filesystem::path& file, const std::string& sonar = {});
Result<Recording> open_recording(std::unique_ptr<Source> source, const std::string& sonar = {});

/// Finds the sonar of a recording by the first message that names its model, or else by its first message and the profile that
/// the file states, within the first 64 MB. Rewinds the reader.
std::optional<SentBy> find_sender(RecordingReader& reader);

}  // namespace sonar::recording
