// A recording of any kind, identified by its first bytes: .oculus log, raw dump, capture (pcap, pcapng), MCAP, .aris, .sonar,
// .svlog. What `sonard replay` and `sonarctl record --from` open.
#pragma once

#include <filesystem>
#include <memory>

#include "protocol/recording/byte_source.hpp"
#include "protocol/recording/recorded_message.hpp"

namespace sonar::recording {

enum class Format { oculus_log, raw_dump, pcap, mcap, aris_file, sonar_file, ping_log };
const char* name_of(Format format);

struct Recording {
  Format format{};
  std::unique_ptr<RecordingReader> reader;
};
/// `sonar`: selects one of several, by IPv4 address in captures, by name in MCAP; empty = the one with most bytes, or the first.
/// missing_file, io, bad_data; usage for a sonar that no such file can name.
Result<Recording> open_recording(const std::filesystem::path& file, const std::string& sonar = {});
Result<Recording> open_recording(std::unique_ptr<Source> source, const std::string& sonar = {});

}  // namespace sonar::recording
