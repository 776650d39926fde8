#include <algorithm>
#include <map>

#include "clients/sonarctl/doctor/probes.hpp"
#include "clients/sonarctl/ping_log.hpp"
#include "clients/sonarctl/ping_stream.hpp"
#include "protocol/control/answers.hpp"

namespace sonar::clients::doctor {
namespace {

using namespace std::chrono_literals;
using Outcome = StreamFacts::Outcome;

constexpr std::uint64_t enough_pings = 15;
constexpr double usual_hz = 10;  // the rate of a driver that sets none
constexpr auto connect_patience = 1000ms, watch_time = 1600ms;

double unix_now_s() { return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(); }
class Watch {
 public:
  Watch(StreamFacts& facts, Steady::time_point deadline) : facts_(facts), deadline_(deadline) {}

  void run(PingStream& stream) {
    bool ended = false;
    while (!ended && !over() && interrupted == 0) {
      const PingStream::Item item = stream.next(std::min<std::chrono::milliseconds>(50ms, left_until(deadline_)));
      ended = item.what == Wait::closed;
      facts_.refuses = ended && item.kind != ErrorKind::io && item.kind != ErrorKind::unavailable;
      if (facts_.refuses) facts_.error = item.error;
      if (item.what != Wait::data) continue;
      if (item.ping) add(*item.ping);
    }
    const auto of_wire = stream.host().counts().value_or(protocol::Host::Counts{});
    facts_.junk_bytes = of_wire.junk_bytes;
    facts_.others = of_wire.messages - facts_.pings;
    facts_.waited_s = seconds_since(start_);
    const bool nothing = facts_.pings == 0 && facts_.others == 0 && facts_.junk_bytes == 0;
    facts_.outcome = facts_.pings > 0                      ? Outcome::pings
                     : nothing && ended && !facts_.refuses ? Outcome::closed_without_a_byte
                                                           : Outcome::no_ping;
    conclude(of_wire.missing_pings);
  }

  /// The delay from transmission to arrival and the computing time of each ping, from events of the control stream.
  struct DaemonTimes {
    std::vector<double> delays_s, computing_ms;
  };
  DaemonTimes daemon_times(ControlClient& control, const std::string& sonar) const {
    DaemonTimes daemon_times;
    for (int i = 0; i < 1000; ++i) {
      const auto event = control.next_event(i == 0 ? 50ms : 0ms);
      if (!event || !*event) break;
      const v1::PingEvent& ping = (*event)->ping();
      if (!(*event)->has_ping() || ping.sonar() != sonar) continue;
      const auto arrived = arrived_unix_s_.find(ping.number());
      if (arrived == arrived_unix_s_.end()) continue;
      daemon_times.delays_s.push_back(arrived->second - static_cast<double>(ping.fired_at_ns()) * 1e-9);
      daemon_times.computing_ms.push_back(ping.simulation_ms());
    }
    return daemon_times;
  }

 private:
  bool over() const {
    if (Steady::now() >= deadline_ || facts_.pings >= enough_pings) return true;
    return facts_.pings > 0 ? seconds_since(first_) * 1s >= watch_time : Steady::now() >= give_up_;
  }

  void add(const HostPing& ping) {
    const double at_s = seconds_since(start_);
    const PingFacts& seen = ping.facts;
    if (facts_.pings == 0) {
      first_ = Steady::now();
      facts_.first_ping_ms = 1000 * at_s;
      facts_.beams = seen.beams, facts_.rows = seen.rows, facts_.bits = seen.bits;
    }
    log_.add(ping, at_s);
    ++facts_.pings;
    if (!ping.errors.empty() && ++facts_.broken == 1) facts_.first_complaint = ping.errors.front();
    if (facts_.pings == 1) return;  // the first ping includes the initial setup, and is reported separately
    arrived_unix_s_[seen.number] = unix_now_s();
    if (ping.fired_s) behind_stamp_s_.push_back(at_s - *ping.fired_s);
  }

  void conclude(std::uint64_t missing) {
    facts_.rate_hz = log_.summary(std::nullopt).rate_hz;
    facts_.missing = missing;
    if (behind_stamp_s_.size() < 3) return;
    const double promptest = *std::min_element(behind_stamp_s_.begin(), behind_stamp_s_.end());
    facts_.spread_p99_ms = 1000 * (percentile(behind_stamp_s_, 0.99) - promptest);
  }

  StreamFacts& facts_;
  Steady::time_point start_ = Steady::now(), first_ = start_, deadline_;
  Steady::time_point give_up_ =
      start_ + left_until(deadline_) / 2;  // for the first ping; the rest of the time is for other sonars
  PingLog log_;
  std::map<std::uint32_t, double> arrived_unix_s_;
  std::vector<double> behind_stamp_s_;
};

/// Returns the outcome of a failed connection or greeting.
Outcome outcome_of(const Error& error, const SonarFacts& sonar) {
  using Kind = protocol::HostPort::Kind;
  const Kind first = sonar.make->ports.front().kind;
  if (error.kind == ErrorKind::io) return Outcome::closed_without_a_byte;
  if (error.kind == ErrorKind::bad_data || error.kind == ErrorKind::usage) return Outcome::no_ping;
  const bool by_tcp = first == Kind::tcp || first == Kind::http;
  const bool is_refused = by_tcp ? refuses(sonar.at) : sonar.on_this_host && sonar.listeners.empty();
  return is_refused ? Outcome::refused : Outcome::unreachable;
}

}  // namespace

void set_latency(SonarFacts& sonar, std::vector<double> delays_s, ControlFacts& clocks) {
  if (delays_s.empty()) return;
  if (clocks.status)
    for (double& delay_s : delays_s) delay_s -= clocks.status->wall_ahead_s();
  const double p50 = percentile(delays_s, 0.5), p99 = percentile(delays_s, 0.99);
  if (!sonar.on_this_host) clocks.clock_ahead_s = -*std::min_element(delays_s.begin(), delays_s.end());
  if (p50 < 0 || p50 > 2) return;  // clocks differ: latency unknown
  sonar.stream.latency_p50_ms = 1000 * p50;
  sonar.stream.latency_p99_ms = 1000 * p99;
}

namespace {

/// Returns the rate at which the sonar pings for us, as its daemon reports it; 0: unknown.
double present_rate_hz(ControlClient& control, const std::string& sonar) {
  const auto status = control.status(500ms);
  if (!status) return 0;
  for (const v1::SonarStatus& s : (*status)->sonars())
    if (s.name() == sonar) return s.rate_hz();
  return 0;
}

}  // namespace

void watch_pings(SonarFacts& sonar, ControlClient* control, Steady::time_point deadline, ControlFacts& clocks) {
  StreamFacts& facts = sonar.stream;
  Wanted wanted;
  // If a client is connected, the check does not change settings.
  wanted.as_it_is = !sonar.clients.empty();
  wanted.stamped = true;
  facts.asked = !wanted.as_it_is || sonar.make->each_ping_requested;
  Watch watch(facts, deadline);
  auto stream =
      PingStream::open(sonar.at, sonar.make, wanted, std::min<std::chrono::milliseconds>(connect_patience, left_until(deadline)));
  if (!stream) {
    facts.error = stream.error().text;
    facts.refuses = stream.error().kind == ErrorKind::usage;
    facts.outcome = outcome_of(stream.error(), sonar);
    return;
  }
  facts.own = stream->own();
  facts.asked_hz = stream->host().expects_echo() ? usual_hz : 0;
  watch.run(*stream);
  // Some sonars drop our rate when we disconnect.
  if (facts.asked_hz == 0 && control != nullptr && !sonar.make->scans) facts.asked_hz = present_rate_hz(*control, sonar.name);
  stream = failure(ErrorKind::io, "closed");
  if (control == nullptr || sonar.make->own_numbers) return;
  const Watch::DaemonTimes daemon_times = watch.daemon_times(*control, sonar.name);
  if (!daemon_times.computing_ms.empty()) facts.computing_ms = percentile(daemon_times.computing_ms, 0.5);
  set_latency(sonar, daemon_times.delays_s, clocks);
}

}  // namespace sonar::clients::doctor
