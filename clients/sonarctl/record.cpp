#include "clients/sonarctl/record.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdio>

#include "clients/sonarctl/elapsed.hpp"
#include "clients/sonarctl/record_files.hpp"
#include "clients/sonarctl/source.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/oculus/decode.hpp"
#include "protocol/oculus/host.hpp"
#include "protocol/recording/message_splitter.hpp"
#include "protocol/recording/recording.hpp"

namespace sonar::clients {
namespace {

using namespace std::chrono_literals;
using recording::Carrier;
using recording::Origin;
using recording::RecordedMessage;
using Steady = std::chrono::steady_clock;

constexpr int most_status_at_once = 32;

/// UNIX time that never decreases when the clock is set.
class Stamps {
 public:
  Time now() const { return began_ + std::chrono::duration_cast<std::chrono::nanoseconds>(Steady::now() - started_); }

 private:
  Time began_ = std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now());
  Steady::time_point started_ = Steady::now();
};

recording::IpEnd end_from(const sockaddr_in& address) { return {ntohl(address.sin_addr.s_addr), ntohs(address.sin_port)}; }

/// Both ends of a connection, for the headers of a capture.
recording::PcapConversation conversation_of(const Socket& socket) {
  recording::PcapConversation conversation;
  sockaddr_in here{}, there{};
  socklen_t here_size = sizeof here, there_size = sizeof there;
  // The socket API requires these casts.
  if (::getsockname(socket.fd(), reinterpret_cast<sockaddr*>(&here), &here_size) == 0) conversation.client = end_from(here);
  if (::getpeername(socket.fd(), reinterpret_cast<sockaddr*>(&there), &there_size) == 0) conversation.device = end_from(there);
  conversation.status_from.address = conversation.device.address;
  return conversation;
}

/// The sonard that serves the device: name of the sonar and a subscription to its pings.
struct Steering {
  ControlClient client;
  std::string sonar;
};
Result<Steering> ask_sonard(const ControlOptions& options, const Endpoint& device) {
  auto client = ControlClient::open(options);
  if (!client) return tl::unexpected(client.error());
  const auto status = client->status();
  if (!status) return tl::unexpected(status.error());
  for (const v1::SonarStatus& sonar : (*status)->sonars()) {
    if (sonar.listens() != text_from(device) && sonar.advertised() != device.host) continue;
    control::Subscribe subscription;
    subscription.pings = true;
    if (auto answer = client->request(subscription); !answer) return tl::unexpected(answer.error());
    return Steering{std::move(*client), sonar.name()};
  }
  return failure(ErrorKind::usage, "the sonard at " + text_from(client->at()) + " serves no sonar at " + text_from(device));
}

/// Records one device up to its limits.
class Recorder {
 public:
  Recorder(const RecordOptions& options, Socket socket, std::optional<Socket> status, std::optional<Steering> steering,
           RecordFiles& files, std::uint32_t device_ip, std::optional<wire::Bytes> fire)
      : options_(options),
        socket_(std::move(socket)),
        status_(std::move(status)),
        steering_(std::move(steering)),
        files_(files),
        device_ip_(device_ip),
        fire_(std::move(fire)) {}

  Result<void> run() {
    if (Result<void> asked = ask(); !asked) return asked;
    while (!enough()) {
      const Read read = read_some(socket_, chunk_, patience());
      if (Result<void> others = take_status(); !others) return others;
      if (Result<void> others = take_poses(); !others) return others;
      if (read.what == Wait::closed)
        return failure(ErrorKind::io, read.error.empty()
                                          ? "the device closed the connection after " + std::to_string(files_.pings()) +
                                                " pings: it stopped, or another client holds it (clients.max)"
                                          : "the connection broke: " + read.error);
      if (read.what == Wait::data) {
        last_byte_ = Steady::now();
        if (Result<void> stored = store(std::span<const std::byte>(chunk_).first(read.size)); !stored) return stored;
      } else if (seconds_since(last_byte_) >= options_.source.silence_limit_s) {
        return failure(ErrorKind::io, "not a byte from the device for " +
                                          std::to_string(std::lround(options_.source.silence_limit_s)) +
                                          " s: is it stopped or stuck?");
      }
    }
    return {};
  }
  double seconds() const { return seconds_since(start_); }

 private:
  bool enough() const {
    return interrupted != 0 || (options_.pings > 0 && files_.pings() >= options_.pings) ||
           (options_.seconds > 0 && seconds() >= options_.seconds);
  }
  std::chrono::milliseconds patience() const {
    const double left_s = options_.seconds > 0 ? options_.seconds - seconds() : 1;
    return milliseconds_from(std::clamp(left_s, 0.0, 0.1));
  }

  Result<void> ask() {
    if (!fire_) return {};
    if (Result<void> sent = write_all(socket_, *fire_); !sent) return sent;
    return files_.write({stamps_.now(), Origin::client, Carrier::stream, *fire_});
  }

  Result<void> store(std::span<const std::byte> bytes) {
    splitter_.append(stamps_.now(), bytes);
    while (const auto message = splitter_.next()) {
      if (enough()) return {};
      const std::uint64_t pings = files_.pings();
      if (Result<void> written = files_.write(*message); !written) return written;
      if (message->bytes.size() >= oculus::header_size) device_id_ = oculus::header_of(message->bytes).source;
      if (options_.source.wanted.more.contains("trigger") && files_.pings() > pings)
        if (Result<void> asked = ask(); !asked) return asked;
    }
    return {};
  }

  /// Records the broadcasts of this device, a bounded number at a time so that a flood does not delay the sonar's bytes.
  Result<void> take_status() {
    for (int stored = 0; status_ && stored < most_status_at_once; ++stored) {
      std::array<std::byte, 2048> datagram;
      const Read read = read_some(*status_, datagram, 0ms);
      if (read.what != Wait::data) return {};
      const auto bytes = std::span<const std::byte>(datagram).first(read.size);
      const auto status = oculus::decode_status(bytes);
      if (!status) continue;
      std::uint32_t ip = 0;
      for (const std::uint8_t octet : status->ip_address) ip = ip << 8 | octet;
      if (ip != device_ip_ && (!device_id_ || status->header.source != *device_id_)) continue;
      if (Result<void> written = files_.write({stamps_.now(), Origin::device, Carrier::datagram, {bytes.begin(), bytes.end()}});
          !written)
        return written;
    }
    return {};
  }

  Result<void> take_poses() {
    while (steering_) {
      const auto event = steering_->client.next_event(0ms);
      if (!event) {
        std::fprintf(stderr, "sonarctl: poses are no longer recorded: %s\n", event.error().text.c_str());
        steering_.reset();
        return {};
      }
      if (!*event) return {};
      if (!(*event)->has_ping() || (*event)->ping().sonar() != steering_->sonar) continue;
      const v1::PingEvent& ping = (*event)->ping();
      const Time fired(std::chrono::nanoseconds(ping.fired_at_ns()));
      if (Result<void> written = files_.write_pose(stamps_.now(), fired, control::pose_of(ping)); !written) return written;
    }
    return {};
  }

  const RecordOptions& options_;
  Socket socket_;
  std::optional<Socket> status_;
  std::optional<Steering> steering_;
  RecordFiles& files_;
  std::uint32_t device_ip_;
  std::optional<wire::Bytes> fire_;  // the settings to ask for; none are sent without it
  std::optional<std::uint16_t> device_id_;
  recording::MessageSplitter splitter_{Origin::device};
  Stamps stamps_;
  Steady::time_point start_ = Steady::now(), last_byte_ = start_;
  std::vector<std::byte> chunk_ = std::vector<std::byte>(1 << 16);
};

void report(const RecordFiles& files, double seconds) {
  const auto counted = [](std::uint64_t n, const char* what) {
    return std::to_string(n).append(" ").append(what).append(n == 1 ? "" : "s");
  };
  std::printf("recorded %s, %s, %.1f MB, %.1f s: %s\n", counted(files.pings(), "ping").c_str(),
              counted(files.messages(), "message").c_str(), static_cast<double>(files.bytes()) / 1e6, seconds,
              files.sizes().c_str());
}

Result<void> record_device(const RecordOptions& options) {
  std::optional<wire::Bytes> fire;
  if (!options.source.wanted.as_it_is) {
    const auto asked = oculus::fire_from(options.source.wanted);
    if (!asked) return tl::unexpected(asked.error());
    fire = oculus::make_fire(*asked);
  }
  const Result<Endpoint> device = find_device(options.source, true);
  if (!device) return tl::unexpected(device.error());
  std::optional<Steering> steering;
  if (options.control) {
    auto asked = ask_sonard(*options.control, *device);
    if (!asked) return tl::unexpected(asked.error());
    steering = std::move(*asked);
  }
  std::optional<Socket> status;
  if (options.status && !(options.pcap.empty() && options.mcap.empty())) {
    auto listening = listen_udp(options.status_on);
    if (listening) status = std::move(*listening);
    if (!listening) std::fprintf(stderr, "sonarctl: no status datagrams will be recorded: %s\n", listening.error().text.c_str());
  }
  auto socket = connect_tcp(*device, milliseconds_from(options.source.connect_patience_s));
  if (!socket) return tl::unexpected(socket.error());
  const recording::PcapConversation conversation = conversation_of(*socket);
  auto files = RecordFiles::create(options, conversation, steering ? steering->sonar : "sonar");
  if (!files) return tl::unexpected(files.error());
  std::printf("connected to %s\n", text_from(*device).c_str());
  std::fflush(stdout);
  Recorder recorder(options, std::move(*socket), std::move(status), std::move(steering), *files, conversation.device.address,
                    std::move(fire));
  const Result<void> ran = recorder.run();
  const double took_s = recorder.seconds();
  const Result<void> closed = files->close();
  report(*files, took_s);
  return ran ? closed : ran;
}

/// Ten a second, as raw dumps have no times.
Time made_up_time(std::uint64_t number) { return Time(number * 100ms); }

/// The writers' formats and the count of pings are of Oculus. bad_data.
Result<void> check_oculus(recording::RecordingReader& reader, const std::string& file) {
  const auto is_oculus = [](const RecordedMessage& message) {
    return message.bytes.size() >= oculus::header_size && oculus::header_of(message.bytes).oculus_id == oculus::magic;
  };
  std::optional<RecordedMessage> message;
  do message = reader.next();
  while (message && interrupted == 0 && !is_oculus(*message));
  const auto damage = reader.damage();
  reader.rewind();
  if (message || interrupted != 0) return {};
  return failure(ErrorKind::bad_data, damage ? damage->text : file + " holds no Oculus messages, and record converts no others");
}

Result<void> convert(const RecordOptions& options) {
  auto opened = recording::open_recording(options.source.recording, options.sonar);
  if (!opened) return tl::unexpected(opened.error());
  recording::RecordingReader& reader = *opened->reader;
  if (Result<void> oculus = check_oculus(reader, options.source.recording.string()); !oculus) return oculus;
  auto files = RecordFiles::create(options, {}, options.sonar.empty() ? "sonar" : options.sonar);
  if (!files) return tl::unexpected(files.error());
  Result<void> written;
  std::optional<Time> first;
  Time last{};
  while (written && interrupted == 0 && (options.pings == 0 || files->pings() < options.pings)) {
    auto message = reader.next();
    if (!message) break;
    if (!reader.knows_times()) message->at = made_up_time(files->messages());
    if (!first) first = last = message->at;
    last = message->at = std::max(last, message->at);
    if (options.seconds > 0 && seconds(last - *first) > options.seconds) break;
    written = files->write(*message);
  }
  const Result<void> closed = files->close();
  report(*files, seconds(last - first.value_or(last)));
  if (!reader.note().empty()) std::printf("%s\n", reader.note().c_str());
  if (!written) return written;
  if (!closed) return closed;
  if (auto damage = reader.damage()) return tl::unexpected(std::move(*damage));
  return {};
}

/// Also of files that are not there yet.
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
  const std::filesystem::path* const paths[] = {&options.pcap, &options.mcap, &options.oculus, &options.raw};
  if (std::all_of(std::begin(paths), std::end(paths), [](const auto* path) { return path->empty(); }))
    return failure(ErrorKind::usage,
                   "say what to write: --pcap, --mcap, --oculus or --raw FILE, any of them (sonarctl record --help)");
  for (std::size_t i = 0; i < std::size(paths); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (!paths[i]->empty() && is_same_file(*paths[i], *paths[k]))
        return failure(ErrorKind::usage, paths[i]->string() + " is named for two kinds of files: give each its own name");
  const std::filesystem::path& from = options.source.recording;
  for (const auto* path : paths) {
    std::error_code ec;
    if (!from.empty() && !path->empty() && std::filesystem::equivalent(from, *path, ec))
      return failure(ErrorKind::usage, path->string() + " is the recording that is read: name another file");
  }
  return from.empty() ? record_device(options) : convert(options);
}

}  // namespace sonar::clients
