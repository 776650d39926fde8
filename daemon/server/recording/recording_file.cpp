#include "daemon/server/recording/recording_file.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "protocol/recording/aris_file.hpp"
#include "protocol/recording/oculus_log.hpp"
#include "protocol/recording/ping_log.hpp"
#include "protocol/recording/raw_dump.hpp"

namespace sonar {
namespace {

using recording::Origin;
using Kind = RecordingFile::Kind;

constexpr std::size_t longest_name = 128;
constexpr auto status_period = std::chrono::seconds(1);
constexpr std::array<std::pair<std::string_view, Kind>, 7> endings{{{".mcap", Kind::mcap},
                                                                    {".pcap", Kind::pcap},
                                                                    {".oculus", Kind::oculus_log},
                                                                    {".raw", Kind::raw_dump},
                                                                    {".aris", Kind::aris},
                                                                    {".sonar", Kind::sonar},
                                                                    {".svlog", Kind::ping_log}}};

bool may_stand_in_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' || c == '.';
}

/// Counts what reaches the file.
class CountedSink final : public recording::Sink {
 public:
  CountedSink(std::unique_ptr<recording::Sink> sink, std::shared_ptr<std::uint64_t> bytes)
      : sink_(std::move(sink)), bytes_(std::move(bytes)) {}
  Result<void> append(recording::BytesView record) override {
    Result<void> appended = sink_->append(record);
    if (appended) *bytes_ += record.size();
    return appended;
  }
  Result<void> overwrite(std::uint64_t offset, recording::BytesView bytes) override { return sink_->overwrite(offset, bytes); }
  void try_again() override { sink_->try_again(); }
  Result<void> close() override { return sink_->close(); }

 private:
  std::unique_ptr<recording::Sink> sink_;
  std::shared_ptr<std::uint64_t> bytes_;
};

}  // namespace

std::size_t RecordedPing::size() const {
  std::size_t sent = bytes ? bytes->size() : 0;
  for (const auto& stream : datagrams)
    for (const protocol::Bytes& datagram : *stream) sent += datagram.size();
  const std::size_t of_labels = ping->labels ? 5 * ping->labels->share.size() : 0;
  return sent + status.size() + ping->samples.size() + of_labels + ping->truth.size() * sizeof(BeamTruth) +
         ping->request.bodies_in_world.size() * sizeof(Pose);
}

Result<Kind> RecordingFile::kind_of(std::string_view name, std::string_view vendor) {
  const auto ending = std::find_if(endings.begin(), endings.end(), [&](const auto& e) { return name.ends_with(e.first); });
  const auto refuse = [&](const char* why) {
    std::string text = "\"";
    text.append(name.substr(0, longest_name)).append("\": ").append(why);
    return failure(ErrorKind::usage, std::move(text));
  };
  if (name.size() > longest_name || name.empty() || name.front() == '.' ||
      !std::all_of(name.begin(), name.end(), may_stand_in_name))
    return refuse("the name of a recording has letters, digits, - _ and . only, 128 at most, and no folder: run-1.mcap");
  if (name.front() == '-')
    return refuse("the name of a recording does not begin with -, which every program takes for an option: run-1.mcap");
  if (ending == endings.end())
    return refuse("name the kind of file by its end: .mcap, .pcap, .oculus, .raw, .aris, .sonar or .svlog");
  if (ending->second == Kind::mcap) return ending->second;
  if (ending->second == Kind::aris && vendor != "aris")
    return refuse("such files hold frames of an ARIS, and this is a sonar of another kind: end the name in .mcap");
  if (ending->second == Kind::sonar && vendor != "waterlinked")
    return refuse("such files hold images of a Sonar 3D-15, and this is a sonar of another kind: end the name in .mcap");
  if (ending->second == Kind::ping_log && vendor != "surveyor240" && vendor != "omniscan450")
    return refuse(
        "such files hold frames of a Surveyor or an Omniscan, and this is a sonar of another kind: end the name in .mcap");
  const bool of_another_vendor =
      ending->second == Kind::aris || ending->second == Kind::sonar || ending->second == Kind::ping_log;
  if (!of_another_vendor && vendor != "oculus")
    return refuse("such files hold Oculus messages, and this is a sonar of another kind: end the name in .mcap");
  return ending->second;
}

Result<std::unique_ptr<RecordingFile>> RecordingFile::create(const std::filesystem::path& file, Kind kind,
                                                             const RecordedSonar& sonar, bool labels) {
  auto sink = recording::create_new_sink(file);
  if (!sink) return tl::unexpected(sink.error());
  return std::make_unique<RecordingFile>(std::move(*sink), kind, sonar, labels);
}

RecordingFile::RecordingFile(std::unique_ptr<recording::Sink> sink, Kind kind, const RecordedSonar& sonar, bool labels)
    : kind_(kind), vendor_(sonar.vendor), labels_(labels) {
  auto counted = std::make_unique<CountedSink>(std::move(sink), bytes_);
  if (kind == Kind::pcap) {
    writer_ = recording::write_pcap(std::move(counted), sonar.ends);
  } else if (kind == Kind::oculus_log) {
    writer_ = recording::write_oculus_log(std::move(counted));
  } else if (kind == Kind::aris) {
    writer_ = recording::write_aris_file(std::move(counted));
  } else if (kind == Kind::sonar) {  // its datagrams, back to back
    writer_ = recording::write_raw_dump(std::move(counted), recording::Carrier::datagram);
  } else if (kind == Kind::ping_log) {
    writer_ = recording::write_ping_log(std::move(counted));
  } else if (kind == Kind::raw_dump) {
    writer_ = recording::write_raw_dump(std::move(counted));
  } else {
    auto session = std::make_unique<recording::McapSession>(std::move(counted), sonar.name, sonar.vendor);
    mcap_ = session.get();
    writer_ = std::move(session);
  }
}

Result<void> RecordingFile::write(const RecordedPing& ping) {
  const bool keeps_status = kind_ == Kind::mcap || kind_ == Kind::pcap;
  if (keeps_status && !ping.status.empty() && (!status_at_ || ping.at - *status_at_ >= status_period)) {
    status_at_ = ping.at;
    if (Result<void> put_it = put({ping.at, Origin::device, recording::Carrier::datagram, ping.status}); !put_it) return put_it;
  }
  if (ping.bytes)
    if (Result<void> put_it = put({ping.at, Origin::device, recording::Carrier::stream, *ping.bytes}); !put_it) return put_it;
  for (const auto& stream : ping.datagrams)
    for (const protocol::Bytes& datagram : *stream)
      if (Result<void> put_it = put({ping.at, Origin::device, recording::Carrier::datagram, datagram}); !put_it) return put_it;
  ++pings_;
  return mcap_ == nullptr ? Result<void>{} : put_truth(ping);
}

Result<void> RecordingFile::put(recording::RecordedMessage message) {
  Result<void> written = writer_->write(message);
  if (written) ++messages_;
  return written;
}

Result<void> RecordingFile::put_truth(const RecordedPing& ping) {
  const PingRequest& request = ping.ping->request;
  if (vendor_ != "oculus")  // whose messages the session reads itself
    if (Result<void> written = mcap_->write_image(ping.at, ping.ping); !written) return written;
  if (Result<void> written = mcap_->write_pose(ping.at, request.fired_at, request.sonar_in_world); !written) return written;
  recording::mcap::PingTruth truth;
  truth.ping = static_cast<std::uint32_t>(request.number);
  truth.fired_at = request.fired_at;
  truth.sonar_in_world = request.sonar_in_world;
  truth.beams = ping.ping->truth;
  truth.bodies_in_world = request.bodies_in_world;
  truth.names = ping.names.get();
  if (labels_ && ping.ping->labels)
    if (Result<void> written = mcap_->write_labels(ping.at, truth, *ping.ping->labels); !written) return written;
  return mcap_->write_truth(ping.at, truth);
}

}  // namespace sonar
