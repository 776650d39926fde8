// The files of one recording session, written in parallel.
#pragma once

#include <memory>
#include <vector>

#include "clients/sonarctl/record_options.hpp"
#include "protocol/recording/mcap/mcap_session.hpp"
#include "protocol/recording/pcap/pcap.hpp"

namespace sonar::clients {

class RecordFiles {
 public:
  /// Creates all files that the options name. `profile`: that of the sonar; empty: unknown. Errors: io; usage for a kind of file
  /// that only another make has.
  static Result<RecordFiles> create(const RecordOptions& options, const Make& make,
                                    const recording::PcapConversation& conversation, const std::string& sonar,
                                    const std::string& profile);

  /// Writes to every file. The first failure ends all of them. Errors: io.
  Result<void> write(const recording::RecordedMessage& message);
  /// Counts the ping whose last message was written; its picture goes to the MCAP file, if any.
  Result<void> write_ping(Time at, const HostPing& ping);
  /// Writes to the MCAP file, if any.
  Result<void> write_pose(Time at, Time of, const Pose& sonar_in_world);
  /// Finishes every file, even after a failure. Returns the first error: io.
  Result<void> close();

  std::uint64_t pings() const { return pings_; }
  std::uint64_t messages() const { return messages_; }
  std::uint64_t bytes() const { return bytes_; }
  bool wants_poses() const { return mcap_ != nullptr; }
  /// "run.pcap 1.2 MB, run.mcap 3.4 MB"
  std::string sizes() const;

 private:
  const Make* make_ = nullptr;
  std::vector<std::unique_ptr<recording::RecordingWriter>> writers_;
  std::vector<std::filesystem::path> paths_;
  recording::McapSession* mcap_ = nullptr;  // one of the writers
  std::uint64_t pings_ = 0, messages_ = 0, bytes_ = 0;
};

}  // namespace sonar::clients
