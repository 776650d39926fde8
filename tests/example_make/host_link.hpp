// The host and the emulated sonar of a make, which talk in virtual time without sockets: for tests and fuzzers of every make.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "daemon/emulator/sonar/sonar.hpp"
#include "daemon/emulator/world/world_parts.hpp"
#include "protocol/host.hpp"
#include "tests/protocol/stream_ports.hpp"

namespace sonar::host_link {

using namespace std::chrono_literals;
using protocol::Bytes;
using protocol::Make;

inline constexpr Time start = Time{} + std::chrono::hours(24 * 365 * 50);
inline constexpr std::chrono::milliseconds step = 50ms, patience = 3s;  // after `patience` without a ping a driver connects again

inline Config surroundings() {
  Config config;
  config.clock = ClockMode::stepped;
  config.water = Water{15, 0, 8, 0};
  config.vehicles.push_back({.name = "rov", .initial_pose = {{0, 0, -3}, {}}});
  return config;
}

inline void require(bool holds, const char* else_what) {
  if (!holds) throw std::logic_error(else_what);
}

inline SonarConfig sonar_of(const Make& make) {
  SonarConfig sonar;
  sonar.name = "front";
  sonar.profile = {make.device, make.device->models().front()};
  sonar.device_id = 7001;
  sonar.options = *protocol::check_options(*make.device, {});
  sonar.max_clients = std::max(1, static_cast<int>(protocol::test::conversations_of(make).size()));
  return sonar;
}

inline std::shared_ptr<const Ping> computed(PingRequest request) {
  auto ping = std::make_shared<Ping>();
  const PingSettings& s = request.settings;
  const auto beams = static_cast<std::size_t>(s.beam_count), rows = static_cast<std::size_t>(s.range_bin_count);
  ping->samples.resize(beams * rows * static_cast<std::size_t>(s.format.bits) / 8);
  for (std::size_t b = 0; b < beams; ++b)
    ping->beam_azimuth_rad.push_back(beams < 2 ? 0.0f : 0.5f - static_cast<float>(b) / static_cast<float>(beams - 1));
  if (s.format.row_gains) ping->row_gain.assign(rows, 1);
  ping->request = std::move(request);
  look_at(*ping);  // as the engine's thread does; otherwise every message of the ping computes the findings again
  return ping;
}

/// A sonar and a driver that connects again when it loses the connection or gets no ping.
class Link {
 public:
  /// `rate_hz` sets the ping rate, if drivers or `sonarctl set sonar` can set it; without `rate_hz` the rate is the usual one.
  explicit Link(const Make& make, std::optional<double> rate_hz = {})
      : make_(make),
        world_(pose_rules(config_), vehicles_of(config_), {}, start),
        sonar({config_, world_}, sonar_of(make), 0, start) {
    using Kind = protocol::Port::Kind;
    for (const protocol::Port& port : make.device->ports())
      if (port.kind == Kind::udp_stream) {
        streams_.push_back(++last_id_);
        perform(sonar.open_stream(last_id_, port, now_));
      }
    for (const auto& [at, port] : protocol::test::conversations_of(make)) lines_.push_back({at, port});
    wanted_.settings.range_m = 3;
    protocol::Wanted at_rate = wanted_;
    at_rate.settings.rate_hz = rate_hz;
    if (make.host(at_rate))
      wanted_ = at_rate;
    else if (!changes(at_rate.settings))
      changes(wanted_.settings);
    connect();
  }

  void run(std::chrono::nanoseconds time) {
    for (const Time end = now_ + time; now_ < end;) step_once();
  }
  bool gets_ping_within(std::chrono::nanoseconds time) {
    const std::size_t before = pings;
    for (const Time end = now_ + time; now_ < end && pings == before;) step_once();
    return pings > before;
  }
  /// Returns false if this make of sonar cannot have the fault.
  bool add(const FaultKind& kind) {
    FaultRecord record;
    record.what = std::string(kind.code);
    const auto faults = check_fault(record, true);
    if (!faults || sonar.why_no_faults(*faults)) return false;
    perform(sonar.add_faults(*faults, true, now_));
    return true;
  }
  /// Sends arbitrary bytes to the sonar on all of its ports.
  void to_sonar(protocol::BytesView bytes) {
    for (std::size_t port = 0; port < make_.ports.size(); ++port) send(port, bytes);
    drain();
  }
  void to_host(std::size_t port, protocol::BytesView bytes) {
    if (make_.ports[port].kind != protocol::HostPort::Kind::http) carry_out(host_->on_bytes(port, bytes, now_));
  }
  std::size_t host_ports() const { return make_.ports.size(); }
  /// Connects an observer, whose host requests nothing.
  void observe() {
    observing_ = *make_.host({.as_it_is = true, .settings = {}});
    perform(sonar.on_connect(observer_ = ++last_id_, Role::observer, {"observer", {127, 0, 0, 1}}, now_));
    static_cast<void>(observing_->on_open(std::vector<std::uint16_t>(make_.ports.size(), 40000), now_));
  }
  void reconnect() { connect(); }
  void end_faults() {
    Actions actions;
    sonar.end_faults({}, now_, actions);
    perform(std::move(actions));
  }

 private:
  const Make& make_;
  Config config_ = surroundings();
  World world_;
  Time now_ = start;

 public:
  Sonar sonar;
  std::size_t pings = 0, observed = 0;

 private:
  bool changes(const protocol::SettingsOverride& settings) {
    auto changed = sonar.change(settings, "the test", now_);
    if (changed) perform(*std::move(changed));
    return changed.has_value();
  }

  void step_once() {
    now_ += step;
    for (int n = 0; n < 100; ++n) {
      const auto next = sonar.next_tick();
      if (!next || *next > now_) break;
      perform(sonar.on_tick(std::max(*next, now_ - step)));
    }
    if (lost_ || now_ - last_sign_ > patience) connect();
    carry_out(host_->on_tick(now_));
    carry_out(host_->on_demand(now_));
    drain();
  }

  /// A TCP connection, or the exchange of datagrams.
  struct Line {
    std::size_t host_port = 0;
    const protocol::Port* port = nullptr;
    ConnectionId id = 0;
    bool served = false;
  };
  Line* line_of(ConnectionId id) {
    const auto found = std::ranges::find(lines_, id, &Line::id);
    return id == 0 || found == lines_.end() ? nullptr : &*found;
  }
  void close() {
    for (Line& line : lines_) {
      line.served = false;
      if (line.id != 0) perform(sonar.on_closed(std::exchange(line.id, 0), "closed by the client", now_, true));
    }
  }

  void connect() {
    close();
    auto host = make_.host(wanted_);
    host_ = host ? *std::move(host) : *make_.host({});  // drivers of some makes set nothing
    lost_ = false;
    last_sign_ = now_;
    for (Line& line : lines_) {
      if (!listens_ && line.port->kind == protocol::Port::Kind::tcp_stream) return;
      line.id = ++last_id_;
      perform(sonar.on_connect(line.id, Role::client, {"driver", {127, 0, 0, 1}}, now_, line.port));
      if (line.id == 0) return;
    }
    carry_out(host_->on_open(std::vector<std::uint16_t>(make_.ports.size(), 40000), now_));
  }

  void send(std::size_t host_port, protocol::BytesView bytes) {
    for (std::size_t i = 0; i < lines_.size(); ++i)
      if (lines_[i].host_port == host_port && lines_[i].id != 0 && lines_[i].served)
        perform(sonar.on_bytes(lines_[i].id, bytes, now_));
  }

  void carry_out(protocol::HostActions actions) {
    for (protocol::HostAction& action : actions) {
      if (const auto* send = std::get_if<protocol::HostSend>(&action)) {
        this->send(send->port, send->bytes);
      } else if (const auto* ask = std::get_if<protocol::ResourceRequest>(&action)) {
        auto answer = sonar.on_http(*make_.device->port(protocol::Port::Kind::http), *ask, now_);
        perform(std::move(answer.actions));
        carry_out(host_->on_reply(answer.reply, now_));
      } else if (std::holds_alternative<protocol::HostPing>(action)) {
        ++pings;
        last_sign_ = now_;
      } else if (std::holds_alternative<Error>(action)) {
        lost_ = true;
      }
    }
  }

  void lose(ConnectionId id) {
    Line* const line = line_of(id);
    if (line == nullptr) return;
    line->id = 0;
    lost_ = true;
    perform(sonar.on_closed(id, "ended", now_));
  }

  void perform(Actions actions) {
    for (Action& action : actions) {
      if (auto* compute = std::get_if<ComputePing>(&action)) {
        perform(sonar.on_ping({.ping = computed(std::move(compute->request)), .seconds = 1e-3}, now_));
      } else if (const auto* serve = std::get_if<Serve>(&action)) {
        if (Line* const line = line_of(serve->connection)) line->served = true;
      } else if (const auto* away = std::get_if<Refuse>(&action)) {
        if (Line* const line = line_of(away->connection)) line->id = 0, lost_ = true;
      } else if (const auto* finish = std::get_if<Finish>(&action)) {
        finished_.push_back(finish->connection);
      } else if (const auto* reset = std::get_if<Reset>(&action)) {
        require(reset->why != "an internal fault", "an internal fault");
        lose(reset->connection);
      } else if (const auto* listen = std::get_if<Listen>(&action)) {
        listens_ = listen->on;
      }
      require(!std::holds_alternative<EngineFailed>(action), "the engine failed");
    }
  }

  /// Writes all waiting messages to the host.
  void drain() {
    std::vector<ConnectionId> ids = streams_;
    for (const Line& line : lines_)
      if (line.id != 0 && line.served) ids.push_back(line.id);
    for (const ConnectionId id : ids)
      while (sonar.connections().find(id) != nullptr) {
        const Outbox::Message message = sonar.next_message(id, now_);
        if (!message) break;
        deliver(id, message);
      }
    for (const ConnectionId id : std::exchange(finished_, {})) lose(id);
    while (const Outbox::Message message = observer_ == 0 ? Outbox::Message{} : sonar.next_message(observer_, now_)) {
      sonar.on_sent(observer_, message.size());
      sonar.on_written(observer_, message, now_);
      for (const auto& action : observing_->on_bytes(0, *message.bytes, now_))
        if (std::holds_alternative<protocol::HostPing>(action)) ++observed;
    }
  }
  void deliver(ConnectionId id, const Outbox::Message& message) {
    std::vector<Bytes> pieces;
    if (message.datagrams != nullptr) pieces = *message.datagrams;
    for (std::size_t copy = 0; message.bytes && copy < std::max<std::size_t>(1, message.prefixes.size()); ++copy) {
      if (!message.prefixes.empty()) pieces.push_back(message.prefixes[copy]);
      pieces.push_back(*message.bytes);
    }
    if (message.datagrams == nullptr) sonar.on_sent(id, message.size());
    sonar.on_written(id, message, now_);
    const Line* const line = line_of(id);
    const bool to_all = message.datagrams != nullptr && line == nullptr;
    const std::size_t host_port = to_all || line == nullptr ? make_.ports.size() - 1 : line->host_port;
    for (const Bytes& piece : pieces)
      if (!lost_ && !(to_all && sonar.receivers(id).empty())) carry_out(host_->on_bytes(host_port, piece, now_));
    if (message.shape != nullptr && message.shape->end != Outbox::Shape::End::none) lose(id);
  }

  protocol::Wanted wanted_;
  std::unique_ptr<protocol::Host> host_, observing_;
  std::vector<ConnectionId> streams_, finished_;
  std::vector<Line> lines_;
  ConnectionId last_id_ = 0, observer_ = 0;
  bool lost_ = false, listens_ = true;
  Time last_sign_ = start;
};

}  // namespace sonar::host_link
