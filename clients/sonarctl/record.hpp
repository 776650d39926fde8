// `sonarctl record`: records the vendor's messages as a client of the sonar, or converts a recording. All files of a session are
// written in parallel.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/sonarctl/commands.hpp"
#include "clients/sonarctl/control_client.hpp"
#include "core/base/result.hpp"
#include "protocol/recording/mcap/mcap_session.hpp"
#include "protocol/recording/pcap/pcap.hpp"

namespace sonar::clients {

struct RecordOptions {
  SourceOptions source;                                     // a device; or source.recording, a recording of any kind
  std::filesystem::path pcap, mcap, raw;                    // at least one of these or of `files`
  std::map<std::string_view, std::filesystem::path> files;  // files of a make's own kinds, by FileKind::ending
  double seconds = 0;                                       // 0 = no limit
  std::uint64_t pings = 0;                                  // 0 = no limit
  bool status = true;                                       // also record the status datagrams of the device
  std::string status_on;  // address for receiving status: HOST:PORT; empty = 0.0.0.0 and the make's port
};

class RecordFiles {
 public:
  /// Creates all files that the options name. `profile`: that of the sonar; empty: unknown. Errors: io; usage for a kind of file
  /// that cannot hold the messages of the make.
  static Result<RecordFiles> create(const RecordOptions& options, const Make& make,
                                    const recording::PcapConversation& conversation, const std::string& sonar,
                                    const std::string& profile);

  /// Writes to the files one after the other, until one fails. Errors: io.
  Result<void> write(const recording::RecordedMessage& message);
  /// Counts the ping whose last message was written; its picture goes to the MCAP file, if any.
  Result<void> write_ping(Time at, const HostPing& ping);
  /// Writes the pose to the MCAP file, if any.
  Result<void> write_pose(Time at, Time of, const Pose& sonar_in_world);
  /// Finishes every file, even after a failure. Returns the first error: io.
  Result<void> close();

  std::uint64_t pings() const { return pings_; }
  std::uint64_t messages() const { return messages_; }
  std::uint64_t bytes() const { return bytes_; }
  /// Returns "run.pcap 1.2 MB, run.mcap 3.4 MB".
  std::string sizes() const;

 private:
  const Make* make_ = nullptr;
  std::vector<std::unique_ptr<recording::RecordingWriter>> writers_;
  std::vector<std::filesystem::path> paths_;
  recording::McapSession* mcap_ = nullptr;  // one of the writers
  std::uint64_t pings_ = 0, messages_ = 0, bytes_ = 0;
};

/// Records until the limits, Ctrl-C or the end of a recording, none of which is an error. After an error, too, the files contain
/// everything so far.
Result<void> record(const RecordOptions& options);

}  // namespace sonar::clients
