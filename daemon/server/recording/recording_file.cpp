#include "daemon/server/recording/recording_file.hpp"

#include <algorithm>
#include <utility>

#include "protocol/recorded/message_splitter.hpp"
#include "protocol/recording/recording.hpp"

namespace sonar {
namespace {

using recording::Origin;
using Kind = RecordingFile::Kind;

constexpr std::size_t longest_name = 128;
constexpr auto status_period = std::chrono::seconds(1);
constexpr const char* another_kind = ", and this is a sonar of another kind: end the name in .mcap";

const protocol::Make& make_of(std::string_view vendor) {
  const protocol::Make* const found = protocol::find_make(vendor);
  return found != nullptr ? *found : protocol::makes().front();
}

/// True if clients of this make receive pings as one byte stream, which a file can contain unchanged.
bool is_one_stream(const protocol::Make& make) {
  return make.codec.framing != nullptr && !make.each_ping_requested && make.device->pings_by() != protocol::PingsBy::datagrams;
}

bool may_stand_in_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' || c == '.';
}

/// A sink that counts the bytes of the file.
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

const recording::FileKind RecordingFile::mcap{.ending = ".mcap", .name = "MCAP", .holds = "pings of any sonar"};
const recording::FileKind RecordingFile::pcap{.ending = ".pcap", .name = "capture", .holds = "pings that are one stream"};
const recording::FileKind RecordingFile::raw_dump{
    .ending = ".raw",
    .name = "raw dump",
    .holds = "pings that are one stream",
    .write = [](std::unique_ptr<recording::Sink> sink) { return recording::write_raw_dump(std::move(sink)); }};

bool RecordingFile::is_plain_name(std::string_view name) {
  return name.size() <= longest_name && !name.empty() && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), may_stand_in_name);
}

bool RecordingFile::is_recording(std::string_view name) {
  const auto ends_so = [name](const recording::FileKind& kind) { return name.ends_with(kind.ending); };
  const auto makes = protocol::makes();
  return is_plain_name(name) && (ends_so(mcap) || ends_so(pcap) || ends_so(raw_dump) ||
                                 std::any_of(makes.begin(), makes.end(), [&](const protocol::Make& make) {
                                   return std::any_of(make.codec.files.begin(), make.codec.files.end(), ends_so);
                                 }));
}

bool RecordingFile::is_inside(const std::filesystem::path& folder, const std::filesystem::path& file) {
  std::error_code ec;
  const std::filesystem::path within = std::filesystem::canonical(folder, ec);
  if (ec) return false;
  const std::filesystem::path place = std::filesystem::canonical(file, ec);
  return !ec && std::mismatch(within.begin(), within.end(), place.begin(), place.end()).first == within.end();
}

/// Returns the format for a name. Only plain file names are allowed, because clients of control choose them.
Result<Kind> RecordingFile::kind_of(std::string_view name, std::string_view vendor) {
  const auto refuse = [&](const std::string& why) {
    return failure(ErrorKind::usage, "\"" + std::string(name.substr(0, longest_name)) + "\": " + why);
  };
  if (!is_plain_name(name))
    return refuse("the name of a recording has letters, digits, - _ and . only, 128 at most, and no folder: run-1.mcap");
  if (name.front() == '-')
    return refuse("the name of a recording must not begin with -, because programs would read it as an option: run-1.mcap");
  // MCAP is possible for all sonars. The next formats are for single streams of any make, then those of this make, then those of
  // other makes, which are refused with a reason.
  if (name.ends_with(mcap.ending)) return &mcap;
  const protocol::Make& own = make_of(vendor);
  for (const Kind kind : {&pcap, &raw_dump}) {
    if (!name.ends_with(kind->ending)) continue;
    if (is_one_stream(own)) return kind;
    return refuse("such files hold " + std::string(kind->holds) + another_kind);
  }
  for (const recording::FileKind& kind : own.codec.files)
    if (name.ends_with(kind.ending)) return &kind;
  for (const protocol::Make& make : protocol::makes())
    for (const recording::FileKind& kind : make.codec.files)
      if (name.ends_with(kind.ending)) return refuse("such files hold " + std::string(kind.holds) + another_kind);
  return refuse("name the kind of file by its end: " + recording::file_endings());
}

Result<std::unique_ptr<RecordingFile>> RecordingFile::create(const std::filesystem::path& file, Kind kind,
                                                             const RecordedSonar& sonar, bool labels) {
  auto sink = recording::create_new_sink(file);
  if (!sink) return tl::unexpected(sink.error());
  return std::make_unique<RecordingFile>(std::move(*sink), kind, sonar, labels);
}

RecordingFile::RecordingFile(std::unique_ptr<recording::Sink> sink, Kind kind, const RecordedSonar& sonar, bool labels)
    : kind_(kind), make_(&make_of(sonar.vendor)), labels_(labels) {
  auto counted = std::make_unique<CountedSink>(std::move(sink), bytes_);
  if (kind == &mcap) {
    auto session = std::make_unique<recording::McapSession>(std::move(counted), sonar.name, *make_, sonar.profile);
    mcap_ = session.get();
    writer_ = std::move(session);
  } else {
    writer_ = kind == &pcap ? recording::write_pcap(std::move(counted), sonar.ends) : kind->write(std::move(counted));
  }
}

/// Writes a status message if one is due, then the bytes of the ping, its datagrams, and in MCAP the truth.
Result<void> RecordingFile::write(const RecordedPing& ping) {
  const bool keeps_status = kind_ == &mcap || kind_ == &pcap;
  if (keeps_status && !ping.status.empty() && (!status_at_ || ping.at - *status_at_ >= status_period)) {
    status_at_ = ping.at;
    if (Result<void> put_it = put({ping.at, Origin::device, recording::Carrier::datagram, ping.status}); !put_it) return put_it;
  }
  if (ping.bytes) {
    protocol::Bytes message = make_->codec.message != nullptr ? make_->codec.message(*ping.bytes) : *ping.bytes;
    if (Result<void> put_it = put({ping.at, Origin::device, recording::Carrier::stream, std::move(message)}); !put_it)
      return put_it;
  }
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
  if (make_->codec.samples == nullptr)  // with a reader, the session takes the samples from the messages
    if (Result<void> written = mcap_->write_image(ping.at, ping.ping); !written) return written;
  if (Result<void> written = mcap_->write_pose(ping.at, request.fired_at, request.sonar_in_world); !written) return written;
  recording::mcap::PingTruth truth;
  truth.ping = static_cast<std::uint32_t>(request.number);
  truth.fired_at = request.fired_at;
  truth.sonar_in_world = request.sonar_in_world;
  truth.beams = ping.ping->truth;
  truth.bodies_in_world = request.bodies_in_world;
  truth.names = ping.names.get();
  // Labels are written before the truth of the same ping, which is the last message of a ping.
  if (labels_ && ping.ping->labels)
    if (Result<void> written = mcap_->write_labels(ping.at, truth, *ping.ping->labels); !written) return written;
  return mcap_->write_truth(ping.at, truth);
}

}  // namespace sonar
