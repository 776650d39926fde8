#include "protocol/waterlinked/sonar_file.hpp"

#include <utility>

#include "protocol/waterlinked/messages.hpp"

namespace sonar::recording {
namespace {

constexpr std::size_t head_bytes = 8;  // magic and length

/// Returns the time in a packet; nullopt for a packet of another kind, or without samples.
std::optional<Time> time_of(BytesView content) {
  const waterlinked::Decoded message = waterlinked::decode(content);
  if (message.ranges) return message.ranges->shot.at;
  if (message.strengths) return message.strengths->shot.at;
  if (message.imu && !message.imu->samples.empty()) return message.imu->samples.back().at;
  return std::nullopt;
}

/// Reads packet by packet; the CRC of a packet shows whether it is complete.
class SonarFileReader final : public RecordingReader {
 public:
  explicit SonarFileReader(std::unique_ptr<Source> source) : source_(std::move(source)), scan_(*source_) {}

  std::optional<RecordedMessage> next() override {
    for (bool searching = false; scan_.left() > 0;) {
      const std::uint64_t at = scan_.position();
      const std::size_t length = waterlinked::rip_length(scan_.peek(head_bytes));
      const BytesView packet = length == 0 ? BytesView{} : scan_.peek(length);
      if (const auto content = waterlinked::rip_content(packet)) {
        at_ = time_of(*content).value_or(at_);
        RecordedMessage message{at_, Origin::device, Carrier::datagram, {packet.begin(), packet.end()}};
        scan_.skip(length);
        return message;
      }
      // A damaged place is reported once; the search continues byte by byte, because a length there may be wrong.
      if (!std::exchange(searching, true)) damages_.add(why(at, length, packet.size()));
      scan_.skip(1);
    }
    return std::nullopt;
  }
  std::optional<Error> damage() const override { return damages_.error(source_->name()); }
  void rewind() override {
    scan_.seek(0);
    at_ = {};
    damages_.clear();
  }

 private:
  std::string why(std::uint64_t at, std::size_t length, std::size_t there) const {
    const std::string place = "byte " + std::to_string(at);
    if (length == 0) return "no packet begins at " + place;
    if (there == length) return "the packet at " + place + " is damaged: wrong CRC or compression";
    return "the file ends at byte " + std::to_string(source_->size()) + " within the packet at " + place + ": only " +
           std::to_string(there) + " of its " + std::to_string(length) + " bytes are there";
  }

  std::unique_ptr<Source> source_;
  Scan scan_;
  Time at_{};
  Damages damages_;
};

}  // namespace

std::unique_ptr<RecordingReader> read_sonar_file(std::unique_ptr<Source> source) {
  return std::make_unique<SonarFileReader>(std::move(source));
}

}  // namespace sonar::recording
