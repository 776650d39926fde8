// The files of one recording session, written side by side. Used by record.
#pragma once

#include <memory>
#include <vector>

#include "clients/sonarctl/record.hpp"
#include "protocol/recording/mcap/mcap_session.hpp"
#include "protocol/recording/pcap/pcap.hpp"

namespace sonar::clients {

class RecordFiles {
 public:
  /// Makes all files that the options name. io.
  static Result<RecordFiles> create(const RecordOptions& options, const recording::PcapConversation& conversation,
                                    const std::string& sonar);

  /// To every file; the first that fails ends them all. io.
  Result<void> write(const recording::Piece& piece);
  /// To the MCAP file, where there is one.
  Result<void> write_pose(Time at, Time of, const Pose& sonar_in_world);
  /// Finishes every file, also after a failure. io, the first.
  Result<void> close();

  std::uint64_t pings() const { return pings_; }
  std::uint64_t messages() const { return messages_; }
  std::uint64_t bytes() const { return bytes_; }
  bool wants_poses() const { return mcap_ != nullptr; }
  /// "run.pcap 1.2 MB, run.mcap 3.4 MB"
  std::string sizes() const;

 private:
  std::vector<std::unique_ptr<recording::PieceWriter>> writers_;
  std::vector<std::filesystem::path> paths_;
  recording::McapSession* mcap_ = nullptr;  // one of the writers
  std::uint64_t pings_ = 0, messages_ = 0, bytes_ = 0;
};

}  // namespace sonar::clients
