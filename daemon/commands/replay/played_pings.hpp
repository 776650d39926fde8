// Returns the pings of a recording for a sonar whose hosts request pings: in order or, for a mechanical scan, by direction.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/emulator/connections/actions.hpp"
#include "protocol/recorded/codec.hpp"

namespace sonar {

struct PlayedPing {
  Time at{};
  PartsByPort parts;
};

class PlayedPings {
 public:
  static constexpr std::size_t most_scan_bytes = 512u << 20;  // limit, because a scan is kept in memory

  /// `codec` must have ping_part. `reader` and `codec` must outlive the object.
  PlayedPings(recording::RecordingReader& reader, const recording::Codec& codec) : reader_(reader), codec_(codec) {}
  /// Reads the first ping, or all lines of a scan. Errors (bad_data) name `file`: it has no ping, or a scan is too long.
  Result<void> open(const std::string& file);
  /// True for a mechanical scan, whose lines nearest() finds; next() returns the pings of all other recordings.
  bool is_scan() const { return !lines_.empty(); }

  /// Returns the next ping; nullopt at the end. Packets of different ports that follow each other are one ping.
  /// If a ping has several messages, the one with the most content is returned.
  std::optional<PlayedPing> next();
  /// True if next() has returned the last ping.
  bool at_end() const { return !ahead_; }
  void rewind();
  /// Returns the line whose direction is nearest to `head_rad`; among equally near lines, the next one after the last returned
  /// line, cyclically.
  const PlayedPing& nearest(double head_rad);

 private:
  struct Part {
    Time at{};
    recording::PingPart part;
    recording::Bytes bytes;
  };
  struct Line {
    double head_rad = 0;
    PlayedPing ping;
  };
  std::optional<Part> read();
  recording::Bytes take_richest();

  recording::RecordingReader& reader_;
  const recording::Codec& codec_;
  std::unique_ptr<recording::MessageSplitter> splitter_;  // for a make whose stream delimits messages
  std::optional<Part> ahead_;                             // the first part of the next ping
  std::vector<Line> lines_;
  std::size_t after_ = 0;  // index of the line after the last returned line
};

}  // namespace sonar
