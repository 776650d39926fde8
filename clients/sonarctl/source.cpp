#include "clients/sonarctl/source.hpp"

#include <cstdio>
#include <thread>

#include "clients/sonarctl/elapsed.hpp"
#include "clients/sonarctl/waiting.hpp"
#include "core/text/format.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/recording/recording.hpp"

namespace sonar::clients {

namespace {

/// This many pings with older settings may still arrive after ours were sent.
constexpr int stale_pings = 4;
constexpr std::chrono::milliseconds first_byte_within{500};  // a sonar without a free slot disconnects at once

/// False for a destination of the sonar's datagrams.
bool is_own(const v1::SonarAddress& of) { return of.protocol() != "status" && of.protocol() != "multicast"; }

/// Returns the first address at which the sonar accepts clients.
const std::string& own_address(const v1::SonarStatus& s) {
  const auto first = std::ranges::find_if(s.addresses(), is_own);
  return first != s.addresses().end() ? first->address() : s.listens();
}

/// True if the sonar is at the device's address; port 0 means any port.
bool is_at(const v1::SonarStatus& s, const Endpoint& device) {
  const auto fits = [&](const std::string& address) {
    const auto at = parse_endpoint(address, {});
    const bool same_host = at && (at->host == device.host || at->host == "0.0.0.0" || s.advertised() == device.host);
    return same_host && (device.port == 0 || at->port == device.port);
  };
  return fits(s.listens()) || fits(s.observers()) ||
         std::ranges::any_of(s.addresses(), [&](const auto& of) { return is_own(of) && fits(of.address()); });
}

Error no_observers(const v1::SonarStatus& s, const Make& make) {
  const bool by_datagrams = make.device->pings_by() == protocol::PingsBy::datagrams;
  const std::string why = by_datagrams                             ? "because it sends pings in datagrams to its host"
                          : make.device->default_max_clients() > 1 ? "because it serves several clients"
                                                                   : "because observers.max is 0 in its configuration";
  return {ErrorKind::unavailable, s.name() + ", " + std::string(make.title) + ", accepts no observers, " + why +
                                      ": leave out --observe to connect as a client; beside a driver, the live view shows its "
                                      "pings and sonarctl recording records them"};
}

struct Observed {
  Endpoint at;     // for observers
  Endpoint sonar;  // for its clients, if the user named the port for observers; else as the user named it
  const Make* make = nullptr;
  bool has_client = false, has_observer = false;
};
struct ServedStatus {
  ControlClient control;
  v1::SonarStatus sonar;
};
Result<ServedStatus> status_at(const ControlOptions& options, const Make* make, const Endpoint& device) {
  const std::string place = device.port != 0 ? text_from(device) : device.host;
  auto control = ControlClient::open(options);
  if (!control) return tl::unexpected(control.error());
  const auto status = control->status();
  if (!status) return tl::unexpected(status.error());
  std::vector<const v1::SonarStatus*> found;
  for (const v1::SonarStatus& s : (*status)->sonars())
    if (is_at(s, device) && (make == nullptr || make == &protocol::make_of_profile(s.profile()))) found.push_back(&s);
  const std::string of_make = make != nullptr ? " of the make " + std::string(make->name()) : "";
  if (found.empty())
    return failure(ErrorKind::unavailable, "the sonard at " + text_from(control->at()) + " serves no sonar" + of_make + " at " +
                                               place + "; --control names another");
  const auto named = [](const v1::SonarStatus* s) { return own_address(*s) + " (" + s->name() + ")"; };
  if (found.size() > 1)
    return failure(ErrorKind::usage,
                   "several sonars are at " + place + ": name one with its port: " + text::joined(found, ", ", named));
  return ServedStatus{*std::move(control), *found.front()};
}

/// Requests the addresses from the sonard that serves the device.
Result<Observed> observed_at(const SourceOptions& source, const Endpoint& device) {
  const auto found = status_at({source.control, source.token_file}, source.make, device);
  if (!found) return tl::unexpected(found.error());
  const v1::SonarStatus& s = found->sonar;
  const Make& make = protocol::make_of_profile(s.profile());
  if (s.observers().empty()) return tl::unexpected(no_observers(s, make));
  const auto at = parse_endpoint(s.observers(), device);
  if (!at) return tl::unexpected(at.error());
  Endpoint sonar = device;
  if (const auto own = parse_endpoint(own_address(s), device); own && at->port == device.port) sonar.port = own->port;
  return Observed{{device.host, at->port}, sonar, &make, s.clients_size() > 0, s.observing() > 0};
}

Result<OpenedStream> observe(const SourceOptions& source, const Endpoint& device) {
  const auto found = observed_at(source, device);
  if (!found) return tl::unexpected(found.error());
  Wanted nothing;
  nothing.as_it_is = true;
  auto stream =
      PingStream::open(found->at, found->make, nothing, milliseconds_from(source.connect_patience_s), source.keeps_messages);
  if (!stream) return tl::unexpected(stream.error());
  const auto now = std::chrono::steady_clock::now();
  if (stream->is_rejected(first_byte_within))
    return failure(ErrorKind::io,
                   "tcp " + text_from(found->at) + " closed the connection: all observer slots are taken (observers.max)");
  std::fprintf(
      stderr,
      "sonarctl: connected to %s as an observer: no settings are sent, pings have the settings of the sonar's clients%s\n",
      text_from(found->at).c_str(), found->has_client ? "" : "; it has none now: pings come when a driver requests them");
  return OpenedStream{*std::move(stream), now, true, found->sonar};
}

Result<HostPing> fetch_live(const SourceOptions& source, bool of_samples) {
  auto opened = connect(source, false);
  if (!opened) return tl::unexpected(opened.error());
  PingStream* const stream = &opened->stream;
  auto give_up = std::chrono::steady_clock::now() + milliseconds_from(source.silence_limit_s);
  PictureProgress progress(source.picture_limit_s);
  std::optional<HostPing> last;
  FirstPingWait waits(source, *stream, opened->observes, true);
  bool received = !stream->host().counts();  // without counts, only pings give items
  for (int stale = 0; interrupted == 0;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(give_up - std::chrono::steady_clock::now());
    PingStream::Item item =
        stream->next(std::clamp(left, std::chrono::milliseconds(0), waits.patience(std::chrono::milliseconds(500))));
    waits.look(item.ping.has_value());
    print_notices(item.notices);
    if (item.what == Wait::closed && item.kind == ErrorKind::usage) return tl::unexpected(closed(item, 0));
    if (item.what == Wait::closed)
      return failure(ErrorKind::io,
                     item.error.empty()
                         ? "the device closed the connection before a ping arrived: another client may be connected "
                           "(clients.max)"
                         : "no ping arrived: " + item.error);
    if (item.what != Wait::data && left.count() <= 0) {
      const char* const hint = opened->observes
                                   ? "the sonar has no client that requests pings"
                                   : "is the sonar in standby? Is the daemon's clock stopped (clock), or the daemon stuck?";
      return tl::unexpected(silence(source, *opened, received, "no ping", hint));
    }
    received = received || item.what == Wait::data;
    if (!item.ping) continue;
    const auto now = std::chrono::steady_clock::now();
    if (!item.ping->is_whole() && !progress.is_over(now) && (!of_samples || item.ping->picture())) {
      give_up = now + milliseconds_from(source.silence_limit_s);
      if (const auto line = progress.line_at(*item.ping, now)) print_notices({*line});
      last = std::move(item.ping);
      continue;
    }
    if (item.ping->echo_mismatches.empty() || ++stale > stale_pings) return *std::move(item.ping);
  }
  if (last) return *std::move(last);
  return failure(ErrorKind::io, "interrupted before a ping arrived");
}

}  // namespace

Result<Served> served_at(const ControlOptions& options, const Make* make, const Endpoint& device) {
  auto found = status_at(options, make, device);
  if (!found) return tl::unexpected(found.error());
  return Served{std::move(found->control), found->sonar.name(), found->sonar.profile()};
}

Result<OpenedStream> open_stream(const SourceOptions& source, const Endpoint& device) {
  if (source.observe) return observe(source, device);
  const Make* make = source.make != nullptr ? source.make : make_at(device.port);
  if (make == nullptr && device.port != 0) make = &protocol::makes().front();
  Rejection rejection;
  auto stream = PingStream::open(device, make, source.wanted, milliseconds_from(source.connect_patience_s), source.keeps_messages,
                                 &rejection);
  const auto now = std::chrono::steady_clock::now();
  if (stream && !stream->is_rejected(first_byte_within)) {
    const Endpoint at = stream->device();
    return OpenedStream{*std::move(stream), now, false, at};
  }
  std::string why = "the device closed the connection before a ping arrived: another client may be connected (clients.max)";
  if (!stream) {
    // A host that waits for an answer before it requests pings notices itself that the sonar closes the connection.
    if (rejection.make == nullptr || interrupted != 0) return tl::unexpected(stream.error());
    why = stream.error().text;
  }
  auto observed = observe(source, stream ? stream->device() : rejection.at);
  if (observed) return observed;
  return failure(ErrorKind::io, why + "; connecting as an observer failed too: " + observed.error().text);
}

Silence::Silence(const SourceOptions& source, const OpenedStream& opened)
    : source_(source), observes_(opened.observes), device_(opened.again), port_(opened.stream.device().port) {}

double Silence::left_s() const { return source_.silence_limit_s - seconds_since(since_); }

bool Silence::is_over() {
  if (left_s() > 0) return false;
  if (!observes_) return true;
  const auto found = observed_at(source_, device_);
  const bool is_served = found && found->at.port == port_ && found->has_observer;
  if (is_served) ends();
  return !is_served && interrupted == 0;
}

void Outage::begins(PingStream& lost) {
  if (!since_) since_ = Clock::now();
  lost.count_as_lost();
  changed_ = lost.host().changed();
}

double Outage::left_s(const SourceOptions& source) const {
  if (!since_) return source.return_limit_s;
  return std::max(0.0, source.return_limit_s - seconds_since(*since_));
}

Result<OpenedStream> open_again(SourceOptions source, const Endpoint& device, Outage& outage, const Error& why,
                                const std::function<void(const std::string&)>& say) {
  using Clock = std::chrono::steady_clock;
  source.wanted.changed = outage.changed();
  const double left_s = outage.left_s(source);
  const auto until = Clock::now() + milliseconds_from(left_s);
  if (left_s > 0) say(why.text + "; connecting again, for " + text::format("%.0f s", left_s));
  while (interrupted == 0 && Clock::now() < until) {
    const auto next = std::min(outage.next_attempt(), until);
    while (interrupted == 0 && Clock::now() < next) std::this_thread::sleep_for(std::chrono::milliseconds(50));
    auto opened = open_stream(source, device);
    if (!opened) continue;
    say("connected again to " + opened->stream.about());
    return opened;
  }
  if (interrupted != 0) return tl::unexpected(why);
  return failure(why.kind, why.text + "; it did not come back within " + text::format("%g s", source.return_limit_s));
}

void print_notices(const std::vector<std::string>& notices) {
  for (const std::string& notice : notices) std::fprintf(stderr, "sonarctl: %s\n", notice.c_str());
}

std::chrono::milliseconds milliseconds_from(double s) { return std::chrono::milliseconds(static_cast<std::int64_t>(s * 1000)); }

namespace {

/// Returns the reason why a sonar with the requested settings sends nothing; empty if it should send pings, and for observers,
/// which send no settings.
std::string reason_for_silence(const SourceOptions& source, bool observes) {
  const std::optional<double> rate_hz = source.wanted.settings.rate_hz;
  if (!rate_hz || source.wanted.as_it_is || observes) return {};
  if (*rate_hz == 0) return "--rate standby requested that";
  if (*rate_hz * source.silence_limit_s >= 1) return {};
  return text::format("--rate %g requested less than one ping in that time; --wait makes it longer", *rate_hz);
}

}  // namespace

Error closed(const PingStream::Item& item, std::uint64_t pings) {
  if (item.kind == ErrorKind::usage || item.is_not_recorded) return {item.kind, item.error};
  if (item.is_from_host) return {ErrorKind::io, item.error};
  if (!item.error.empty()) return {ErrorKind::io, "the connection broke: " + item.error};
  return {ErrorKind::io, "the device closed the connection after " + std::to_string(pings) +
                             " pings: it stopped, or another client holds it (clients.max)"};
}

Error silence(const SourceOptions& source, const OpenedStream& opened, bool received, const std::string& what,
              const std::string& hint) {
  const PingStream& stream = opened.stream;
  const std::string limit = text::format("%g s", source.silence_limit_s), asked = reason_for_silence(source, opened.observes);
  if (received) return {ErrorKind::io, what + " arrived within " + limit + ": " + (asked.empty() ? hint : asked)};
  return {ErrorKind::unavailable,
          "no message of " + std::string(stream.make().title) + " arrived from tcp " + text_from(stream.device()) + " within " +
              limit + ": " + (asked.empty() ? "" : asked + "; or ") + "is it another sonar?" +
              (source.wanted.as_it_is ? " Some sonars send nothing before they receive settings (--as-it-is sends none)." : "") +
              " sonard's banner names the address of each sonar"};
}

Result<void> check_output(const SourceOptions& source, const std::filesystem::path& output) {
  std::error_code ec;
  if (source.recording.empty() || output.empty() || !std::filesystem::equivalent(source.recording, output, ec)) return {};
  return failure(ErrorKind::usage, output.string() + " is the recording that is read: name another file");
}

Result<Endpoint> find_device(const SourceOptions& source, bool say) {
  if (!source.discover) return source.device;
  constexpr std::chrono::seconds patience{5};
  std::fprintf(stderr, "sonarctl: waiting for the status broadcast of a sonar, at most %d s\n",
               static_cast<int>(patience.count()));
  auto found = discover(patience);
  if (!found) return tl::unexpected(found.error());
  if (say) std::printf("status from device %u at %s\n", found->announced.device_id, text_from(found->device).c_str());
  if (const auto& wrong = found->announced.complaints; !wrong.empty())
    return failure(ErrorKind::bad_data, "the status datagram: " + wrong.front());
  return found->device;
}

Result<OpenedStream> connect(const SourceOptions& source, bool say) {
  const Result<Endpoint> device = find_device(source, say);
  if (!device) return tl::unexpected(device.error());
  return open_stream(source, *device);
}

Result<HostPing> read_ping(const std::filesystem::path& file, std::optional<std::size_t> number, const std::string& sonar) {
  auto opened = recording::open_recording(file, sonar);
  if (!opened) return tl::unexpected(opened.error());
  auto pings = recording::RecordedPings::open(std::move(opened->reader));
  if (!pings) return failure(pings.error().kind, file.string() + " " + pings.error().text);
  std::optional<HostPing> last;
  std::size_t count = 0;
  const auto note_damage = [&pings] {
    if (const auto damage = pings->reader().damage())
      std::fprintf(stderr, "sonarctl: %s; the ping is from the undamaged part\n", damage->text.c_str());
  };
  while (auto found = pings->next()) {
    if (number ? count == *number : found->ping.is_whole()) note_damage();
    if (number ? count++ == *number : found->ping.is_whole()) return std::move(found->ping);
    last = std::move(found->ping);
  }
  if (last && !number) {
    note_damage();
    return *std::move(last);
  }
  if (last)
    return failure(ErrorKind::usage,
                   file.string() + " holds pings 0 to " + std::to_string(count - 1) + ", not " + std::to_string(*number));
  const auto damage = pings->reader().damage();
  return failure(ErrorKind::bad_data, file.string() + " holds no ping of a known sonar" + (damage ? ": " + damage->text : ""));
}

Result<HostPing> fetch_ping(const SourceOptions& source, std::optional<std::size_t> number, bool of_samples) {
  return source.recording.empty() ? fetch_live(source, of_samples) : read_ping(source.recording, number, source.sonar);
}

}  // namespace sonar::clients
