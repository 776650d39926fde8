#include "clients/sonarctl/record.hpp"

#include <arpa/inet.h>
#include <algorithm>
#include <array>
#include <cstdio>

#include "clients/sonarctl/ping_log.hpp"
#include "clients/sonarctl/source.hpp"
#include "clients/sonarctl/waiting.hpp"
#include "core/text/format.hpp"
#include "core/text/ipv4.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/recorded/message_splitter.hpp"
#include "protocol/recording/recording.hpp"

namespace sonar::clients {
namespace {

using namespace std::chrono_literals;
using recording::Carrier;
using recording::Origin;
using recording::RecordedMessage;

constexpr int most_status_at_once = 32;

/// Connects to the sonard that serves the device, and subscribes to its pings.
Result<Served> ask_sonard(const SourceOptions& source, const Make* make, const Endpoint& device) {
  ControlOptions options{source.control, source.token_file};
  // The sonar may have no sonard, and its pings wait meanwhile.
  if (source.control.empty()) options.connect_patience = 300ms, options.greeting_patience = 1000ms;
  auto served = served_at(options, make, device);
  if (!served) return served;
  control::Subscribe subscription;
  subscription.pings = true;
  if (auto answer = served->control.request(subscription); !answer) return tl::unexpected(answer.error());
  return served;
}

/// Records one device up to its limits.
class Recorder {
 public:
  Recorder(const RecordOptions& options, OpenedStream opened, std::optional<Socket> status, std::optional<Served> served,
           RecordFiles& files)
      : options_(options),
        waits_(options.source, opened.stream, opened.observes),
        silence_(options.source, opened),
        stream_(std::move(opened.stream)),
        device_ip_(stream_.conversation().device.address),
        status_(std::move(status)),
        served_(std::move(served)),
        files_(files) {}

  Result<void> run() {
    while (!enough()) {
      const PingStream::Item item = stream_.next(patience());
      if (Result<void> stored = store(item); !stored) return stored;
      if (Result<void> others = take_status(); !others) return others;
      if (Result<void> others = take_poses(); !others) return others;
      if (item.what == Wait::closed) return failure(item.kind, closed(item, files_.pings()).text);
      if (item.what == Wait::data)
        silence_.ends();
      else if (silence_.is_over())
        return failure(ErrorKind::io, "not a byte from the device for " +
                                          std::to_string(std::lround(options_.source.silence_limit_s)) +
                                          " s: is it stopped or stuck?");
    }
    return {};
  }
  double seconds() const { return seconds_since(start_); }
  /// Notices that were not printed.
  std::vector<std::string> rest_of_notices() const { return notices_.rest(); }

 private:
  bool enough() const {
    return interrupted != 0 || (options_.pings > 0 && files_.pings() >= options_.pings) ||
           (options_.seconds > 0 && seconds() >= options_.seconds);
  }
  std::chrono::milliseconds patience() const {
    const double left_s = options_.seconds > 0 ? options_.seconds - seconds() : 1;
    return milliseconds_from(std::clamp(left_s, 0.0, 0.1));
  }

  Result<void> store(const PingStream::Item& item) {
    print_notices(notices_.kept(item.notices));
    for (const RecordedMessage& message : item.messages) {
      if (Result<void> written = files_.write(message); !written) return written;
      last_ = std::max(last_, message.at);
    }
    waits_.look(item.ping.has_value());
    return item.ping ? files_.write_ping(last_, *item.ping) : Result<void>{};
  }

  /// Records the broadcasts of this device, a bounded number at a time so that a flood does not delay the sonar's bytes.
  Result<void> take_status() {
    for (int stored = 0; status_ && stored < most_status_at_once; ++stored) {
      std::array<std::byte, 2048> bytes;
      const Datagram datagram = receive_from(*status_, bytes, 0ms);
      if (datagram.what != Wait::data) return {};
      if (!is_of_device(datagram, std::span(bytes).first(datagram.size))) continue;
      last_ = std::max(last_, stream_.unix_now());
      if (Result<void> written =
              files_.write({last_, Origin::device, Carrier::datagram, {bytes.begin(), bytes.begin() + datagram.size}});
          !written)
        return written;
    }
    return {};
  }

  /// Compares the sender, and the address in the status message: a sonar that listens at every address may send from another one.
  bool is_of_device(const Datagram& datagram, std::span<const std::byte> status) const {
    if (ntohl(datagram.ip) == device_ip_) return true;
    const auto announced = stream_.make().announced != nullptr ? stream_.make().announced(status) : std::nullopt;
    return announced && text::number_from_ipv4(announced->address) == device_ip_;
  }

  Result<void> take_poses() {
    while (served_) {
      const auto event = served_->control.next_event(0ms);
      if (!event) {
        std::fprintf(stderr, "sonarctl: poses are no longer recorded: %s\n", event.error().text.c_str());
        served_.reset();
        return {};
      }
      if (!*event) return {};
      if (!(*event)->has_ping() || (*event)->ping().sonar() != served_->sonar) continue;
      const v1::PingEvent& ping = (*event)->ping();
      const Time fired(std::chrono::nanoseconds(ping.fired_at_ns()));
      if (Result<void> written = files_.write_pose(last_, fired, control::pose_of(ping)); !written) return written;
    }
    return {};
  }

  const RecordOptions& options_;
  FirstPingWait waits_;
  Silence silence_;
  PingStream stream_;
  std::uint32_t device_ip_;
  std::optional<Socket> status_;
  std::optional<Served> served_;
  RecordFiles& files_;
  NoticeLog notices_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  Time last_ = stream_.unix_now();  // time of the latest recorded message
};

void report(const RecordFiles& files, double seconds) {
  std::printf("recorded %s, %s, %.1f MB, %.1f s: %s\n", text::counted(files.pings(), "ping").c_str(),
              text::counted(files.messages(), "message").c_str(), static_cast<double>(files.bytes()) / 1e6, seconds,
              files.sizes().c_str());
}

/// Opens the socket for status datagrams. Returns nullopt if none are to be recorded or, with a note, if that fails.
std::optional<Socket> listen_to_status(const RecordOptions& options, const Make& make) {
  const protocol::Port* const beacon = make.device->port(protocol::Port::Kind::udp_beacon);
  if (!options.status || beacon == nullptr || (options.pcap.empty() && options.mcap.empty())) return std::nullopt;
  const auto at = parse_endpoint(options.status_on, {"0.0.0.0", beacon->number});
  auto listening = at ? listen_udp(*at) : tl::unexpected(at.error());
  if (listening) return *std::move(listening);
  std::fprintf(stderr, "sonarctl: no status datagrams will be recorded: %s\n", listening.error().text.c_str());
  return std::nullopt;
}

Result<void> record_device(RecordOptions options) {
  SourceOptions& source = options.source;
  source.keeps_messages = true;
  const Result<Endpoint> device = find_device(source, true);
  if (!device) return tl::unexpected(device.error());
  std::optional<Served> served;
  if (!source.control.empty() && !options.mcap.empty()) {
    auto asked = ask_sonard(source, source.make, *device);
    if (!asked) return tl::unexpected(asked.error());
    served = *std::move(asked);
  }
  auto opened = open_stream(source, *device);
  if (!opened) return tl::unexpected(opened.error());
  const PingStream& stream = opened->stream;
  const std::string at = text_from(stream.device());
  if (!served && !options.mcap.empty()) {  // the sonar is there now, and so is its sonard, if it has one on this computer
    auto asked = listen_udp({stream.device().host, 0}).has_value()
                     ? ask_sonard(source, &stream.make(), stream.device())
                     : failure(ErrorKind::unavailable, "the sonar is not on this computer; --control names its sonard");
    if (asked)
      served = *std::move(asked);
    else
      std::fprintf(stderr, "sonarctl: no poses will be recorded: %s\n", asked.error().text.c_str());
  }
  auto status = listen_to_status(options, stream.make());
  auto files = RecordFiles::create(options, stream.make(), stream.conversation(), served ? served->sonar : "sonar",
                                   served ? served->profile : "");
  if (!files) return tl::unexpected(files.error());
  std::printf("connected to %s\n", at.c_str());
  std::fflush(stdout);
  Recorder recorder(options, *std::move(opened), std::move(status), std::move(served), *files);
  const Result<void> ran = recorder.run();
  const double took_s = recorder.seconds();
  print_notices(recorder.rest_of_notices());
  const Result<void> closed = files->close();
  report(*files, took_s);
  if (ran && closed && files->messages() == 0 && interrupted == 0)
    return failure(ErrorKind::unavailable, "no message came from " + at + ", so the files hold none: is the sonar suspended?");
  return ran ? closed : ran;
}

/// Returns times at intervals of 0.1 s, because raw dumps have no times.
Time made_up_time(std::uint64_t number) { return Time(number * 100ms); }

Result<void> convert(const RecordOptions& options) {
  const std::string& name = options.source.sonar;
  auto opened = recording::open_recording(options.source.recording, name);
  if (!opened) return tl::unexpected(opened.error());
  recording::RecordingReader& reader = *opened->reader;
  const auto by = recording::find_sender(reader);
  if (!by) {
    while (reader.next()) continue;
    const auto damage = reader.damage();
    return failure(ErrorKind::bad_data,
                   damage ? damage->text : options.source.recording.string() + " holds no messages of a known sonar");
  }
  Wanted nothing;
  nothing.as_it_is = true;
  const auto host = by->make->host(nothing);
  if (!host) return tl::unexpected(host.error());
  auto files = RecordFiles::create(options, *by->make, recording::usual_ends(*by->make), name.empty() ? "sonar" : name,
                                   by->sender.names_model ? by->sender.model->profile : "");
  if (!files) return tl::unexpected(files.error());
  Result<void> written;
  std::optional<Time> first;
  Time last{};
  const auto keep_pings = [&](const RecordedMessage* message) {
    for (const recording::RecordedPing& decoded : recording::decode_next(**host, *by->make, message))
      if (written) written = files->write_ping(last, decoded.ping);
  };
  while (written && interrupted == 0 && (options.pings == 0 || files->pings() < options.pings)) {
    auto message = reader.next();
    if (!message) break;
    if (!reader.knows_times()) message->at = made_up_time(files->messages());
    if (!first) first = last = message->at;
    last = message->at = std::max(last, message->at);
    if (options.seconds > 0 && seconds(last - *first) > options.seconds) break;
    written = files->write(*message);
    keep_pings(&*message);
  }
  keep_pings(nullptr);
  const Result<void> closed = files->close();
  report(*files, seconds(last - first.value_or(last)));
  if (!reader.note().empty()) std::printf("%s\n", reader.note().c_str());
  if (!written) return written;
  if (!closed) return closed;
  if (auto damage = reader.damage()) return tl::unexpected(std::move(*damage));
  return {};
}

/// Returns whether two names mean the same file, also if the file does not exist yet.
bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code ec;
  if (a == b || std::filesystem::equivalent(a, b, ec)) return true;
  const auto place = [&ec](const auto& path) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(path, ec), ec);
  };
  const std::filesystem::path first = place(a);
  return !first.empty() && first == place(b);
}

}  // namespace

Result<void> record(const RecordOptions& options) {
  std::vector<std::filesystem::path> paths{options.pcap, options.mcap, options.raw};
  for (const auto& [ending, path] : options.files) paths.push_back(path);
  std::erase_if(paths, [](const auto& path) { return path.empty(); });
  if (paths.empty())
    return failure(ErrorKind::usage,
                   "give at least one output: --pcap, --mcap, --raw or a file format of a maker; several are possible "
                   "(sonarctl record --help)");
  for (std::size_t i = 0; i < paths.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (is_same_file(paths[i], paths[k]))
        return failure(ErrorKind::usage, paths[i].string() + " is named for two kinds of files: give each its own name");
  for (const auto& path : paths)
    if (Result<void> other = check_output(options.source, path); !other) return other;
  return options.source.recording.empty() ? record_device(options) : convert(options);
}

namespace {

/// Converts a picture to codes of 8 or 16 bits.
recording::Samples samples_of(const PolarImage& image, unsigned bits) {
  const auto codes = std::make_shared<wire::Bytes>();
  const std::uint32_t most = bits == 8 ? 0xFF : 0xFFFF;
  for (const float sample : image.samples) {
    const auto code = std::min(static_cast<std::uint32_t>(std::max(0.0f, sample)), most);
    codes->push_back(static_cast<std::byte>(code & 0xFF));
    if (bits != 8) codes->push_back(static_cast<std::byte>(code >> 8));
  }
  return {image.beams, image.rows, bits == 8 ? 8 : 16, codes};
}

}  // namespace

Result<RecordFiles> RecordFiles::create(const RecordOptions& options, const Make& make,
                                        const recording::PcapConversation& conversation, const std::string& sonar,
                                        const std::string& profile) {
  RecordFiles files;
  files.make_ = &make;
  Result<void> made;
  const auto& kinds = make.codec.files;
  for (const auto& [ending, path] : options.files) {
    if (std::none_of(kinds.begin(), kinds.end(), [&wanted = ending](const auto& kind) { return kind.ending == wanted; }))
      return failure(ErrorKind::usage, path.string() + ": such files do not hold the messages of " + std::string(make.title) +
                                           ": --mcap and --pcap hold those of every sonar");
  }
  // In one file, the bytes of several connections could not be distinguished.
  const bool has_raw_dumps =
      make.codec.framing != nullptr ||
      std::any_of(kinds.begin(), kinds.end(), [](const recording::FileKind& kind) { return kind.is_raw_dump; });
  if (!options.raw.empty() && (make.has_several_streams() || !has_raw_dumps))
    return failure(ErrorKind::usage, options.raw.string() + ": a raw dump of " + std::string(make.title) +
                                         " cannot be read back: --mcap and --pcap hold its messages");
  const auto add = [&](const std::filesystem::path& path, const auto& writer_of) {
    if (path.empty() || !made) return;
    auto sink = recording::create_sink(path);
    if (!sink) {
      made = tl::unexpected(sink.error());
      return;
    }
    files.writers_.push_back(writer_of(std::move(*sink)));
    files.paths_.push_back(path);
  };
  add(options.pcap, [&](auto sink) { return recording::write_pcap(std::move(sink), conversation); });
  for (const recording::FileKind& kind : make.codec.files)
    if (const auto named = options.files.find(kind.ending); named != options.files.end()) add(named->second, kind.write);
  add(options.raw, [&make](auto sink) {
    const bool by_tcp = make.device->pings_by() != protocol::PingsBy::datagrams;
    return recording::write_raw_dump(std::move(sink), by_tcp ? recording::Carrier::stream : recording::Carrier::datagram);
  });
  add(options.mcap, [&](auto sink) {
    auto session = std::make_unique<recording::McapSession>(std::move(sink), sonar, make, profile);
    files.mcap_ = session.get();
    return session;
  });
  if (!made) return tl::unexpected(made.error());
  return files;
}

Result<void> RecordFiles::write(const recording::RecordedMessage& message) {
  for (const auto& writer : writers_)
    if (Result<void> written = writer->write(message); !written) return written;
  ++messages_;
  bytes_ += message.bytes.size();
  return {};
}

Result<void> RecordFiles::write_ping(Time at, const HostPing& ping) {
  ++pings_;
  // The session itself makes images from messages with samples. For scans nothing is written, because each line would add a
  // whole picture.
  if (mcap_ == nullptr || make_->codec.samples != nullptr || make_->scans) return {};
  const Result<PolarImage> image = ping.picture();
  return image ? mcap_->write_image(at, samples_of(*image, ping.facts.bits)) : Result<void>{};  // some pings make no picture
}

Result<void> RecordFiles::write_pose(Time at, Time of, const Pose& sonar_in_world) {
  return mcap_ == nullptr ? Result<void>{} : mcap_->write_pose(at, of, sonar_in_world);
}

Result<void> RecordFiles::close() {
  Result<void> first;
  for (const auto& writer : writers_)
    if (Result<void> closed = writer->close(); !closed && first) first = closed;
  return first;
}

std::string RecordFiles::sizes() const {
  std::string text;
  for (const auto& path : paths_) {
    std::error_code ec;
    const auto size = std::filesystem::file_size(path, ec);
    char figure[32];
    std::snprintf(figure, sizeof figure, " %.1f MB", ec ? 0.0 : static_cast<double>(size) / 1e6);
    text += (text.empty() ? "" : ", ") + path.string() + figure;
  }
  return text;
}

}  // namespace sonar::clients
