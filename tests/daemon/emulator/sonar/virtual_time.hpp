// Emulated sonars without sockets, threads or a clock, for tests. Time passes from one event to the next; pings take no time.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <list>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/config/load_config.hpp"
#include "daemon/emulator/reload_plan.hpp"
#include "daemon/emulator/sonar/sonar.hpp"
#include "daemon/emulator/world/world_parts.hpp"
#include "protocol/oculus/decode.hpp"
#include "protocol/oculus/fire.hpp"

namespace sonar::testing_emulator {

inline constexpr Time start = Time{} + std::chrono::hours(24 * 365 * 50);

inline Config parsed(const std::string& yaml) {
  std::ofstream(::testing::TempDir() + "/empty.yaml") << "name: empty\n";
  const auto config = parse_config(yaml, "test.yaml", ::testing::TempDir());
  if (!config) throw std::runtime_error(config.error().text);
  return *config;
}

/// Calls all sonars of a configuration. Time passes from one event to the next, pings take no time, and clients read as
/// much as their test lets them.
class VirtualTime {
 public:
  explicit VirtualTime(const std::string& yaml, FaultJournal* faults = nullptr)
      : config(parsed(yaml)), world(pose_rules(config), vehicles_of(config), {}, start), journal(faults) {
    for (const SonarConfig& s : config.sonars) sonars.emplace_back(around(), s, ++last_index, now);
  }

  struct Client {
    Sonar* sonar = nullptr;
    bool served = false, finished = false, closed = false, waits = false, reset = false, is_read = true;
    std::string why;
    bool reads = true;
    protocol::Bytes received;
    std::vector<Outbox::Shape::Pause> pauses;
  };
  bool listens(const std::string& name) { return !listening.contains(&sonar(name)) || listening[&sonar(name)]; }
  /// Adds a fault as the daemon's control does.
  void add_fault(const std::string& name, const FaultRecord& record, bool manual = true) {
    const auto faults = check_fault(record, manual);
    if (!faults) throw std::runtime_error(faults.error().text);
    if (const auto why = sonar(name).why_no_faults(*faults)) throw std::runtime_error(why->text);
    perform(sonar(name), sonar(name).add_faults(*faults, manual, now));
  }
  void end_faults(const std::string& name, const std::string& fault = {}) {
    Actions actions;
    sonar(name).end_faults(fault, now, actions);
    perform(sonar(name), std::move(actions));
  }
  Sonar& sonar(const std::string& name) {
    return *std::find_if(sonars.begin(), sonars.end(), [&](const Sonar& s) { return s.config().name == name; });
  }
  ConnectionId connect(const std::string& name, Role role = Role::client, const protocol::Port* port = nullptr) {
    const ConnectionId id = ++last_id;
    clients[id].sonar = &sonar(name);
    perform(sonar(name), sonar(name).on_connect(id, role, {"client " + std::to_string(id), {127, 0, 0, 1}}, now, port));
    return id;
  }
  void send(ConnectionId id, const protocol::Bytes& bytes) {
    Sonar& to = *clients[id].sonar;
    perform(to, to.on_bytes(id, bytes, now));
  }
  void close(ConnectionId id, const std::string& why = "closed by the client") {
    Client& client = clients[id];
    client.closed = true;
    perform(*client.sonar, client.sonar->on_closed(id, why, now));
  }
  void run(std::chrono::nanoseconds time) {
    const Time until = now + time;
    while (Sonar* const sonar = first_due(until)) {
      now = std::max(now, *sonar->next_tick());
      perform(*sonar, sonar->on_tick(now));
    }
    now = until;
  }
  /// Reloads as Fleet does, but without listeners.
  void reload(const std::string& yaml) {
    const Config next = parsed(yaml);
    for (auto it = sonars.begin(); it != sonars.end();) {
      const auto s = it++;
      const SonarChange change = sonar_change(s->config(), config, next);
      if (change == SonarChange::removed || change == SonarChange::changed) {
        perform(*s, s->stop("the configuration changed"));
        retired.splice(retired.end(), sonars, s);
      } else {
        s->move(*sonar_named(next.sonars, s->config().name), now);
      }
    }
    config = next;
    for (const SonarConfig& s : config.sonars)
      if (std::none_of(sonars.begin(), sonars.end(), [&](const Sonar& old) { return old.config().name == s.name; }))
        sonars.emplace_back(around(), s, ++last_index, now);
  }

  /// Returns a ping of a few rows, as the engine might make it.
  static std::shared_ptr<const Ping> computed(PingRequest request) {
    auto ping = std::make_shared<Ping>();
    PingSettings& s = request.settings;
    if (request.model->profile.starts_with("oculus")) s.range_bin_count = std::min(s.range_bin_count, 4);
    const auto beams = static_cast<std::size_t>(s.beam_count), rows = static_cast<std::size_t>(s.range_bin_count);
    ping->samples.resize(beams * rows * static_cast<std::size_t>(s.format.bits) / 8);
    for (std::size_t b = 0; b < beams; ++b)
      ping->beam_azimuth_rad.push_back(0.5f - static_cast<float>(b) / static_cast<float>(beams));
    if (s.format.row_gains) ping->row_gain.assign(rows, 1);
    ping->request = std::move(request);
    look_at(*ping);
    return ping;
  }

  Config config;
  World world;
  Time now = start;
  std::list<Sonar> sonars, retired;
  std::map<ConnectionId, Client> clients;
  std::vector<std::string> log;
  std::uint64_t pings = 0;
  std::vector<std::optional<protocol::Distance>> distances;  // one for each ping that was queued
  FaultJournal* journal = nullptr;
  std::map<const Sonar*, bool> listening;

 private:
  Sonar::Surroundings around() const { return {config, world, journal}; }
  Sonar* first_due(Time before) {
    Sonar* first = nullptr;
    for (Sonar& s : sonars)
      if (const auto t = s.next_tick(); t && *t < before && (first == nullptr || *t < *first->next_tick())) first = &s;
    return first;
  }
  void perform(Sonar& sonar, Actions actions) {
    for (Action& action : actions) {
      if (auto* compute = std::get_if<ComputePing>(&action)) {
        ++pings;
        perform(sonar, sonar.on_ping({.ping = computed(std::move(compute->request)), .seconds = 1e-3}, now));
      } else if (const auto* wake = std::get_if<Wake>(&action)) {
        read(wake->connection, clients[wake->connection]);
      } else if (const auto* serve = std::get_if<Serve>(&action)) {
        clients[serve->connection].served = true;
        clients[serve->connection].waits = false;
      } else if (const auto* wait = std::get_if<KeepWaiting>(&action)) {
        clients[wait->connection].waits = true;
      } else if (const auto* away = std::get_if<Refuse>(&action)) {
        clients[away->connection].closed = true;
        clients[away->connection].reset = away->reset;
      } else if (const auto* finish = std::get_if<Finish>(&action)) {
        clients[finish->connection].finished = true;
        clients[finish->connection].why = finish->why;
      } else if (const auto* reset = std::get_if<Reset>(&action)) {
        clients[reset->connection].reset = true;
        if (!clients[reset->connection].closed) close(reset->connection, reset->why);
      } else if (const auto* ports = std::get_if<Listen>(&action)) {
        listening[&sonar] = ports->on;
      } else if (const auto* reads = std::get_if<ReadFrom>(&action)) {
        clients[reads->connection].is_read = reads->on;
      } else if (const auto* queued = std::get_if<PingQueued>(&action)) {
        distances.push_back(queued->distance);
      } else if (const auto* report = std::get_if<Report>(&action)) {
        log.push_back(report->line.phrase);
      }
    }
    for (auto& [id, client] : clients) read(id, client);
  }
  void read(ConnectionId id, Client& client) {
    if (!client.reads || !client.served || client.closed) return;
    while (const Outbox::Message message = client.sonar->next_message(id, now)) {
      for (std::size_t copy = 0; copy < std::max<std::size_t>(1, message.prefixes.size()); ++copy) {
        if (!message.prefixes.empty())
          client.received.insert(client.received.end(), message.prefixes[copy].begin(), message.prefixes[copy].end());
        client.received.insert(client.received.end(), message.bytes->begin(), message.bytes->end());
      }
      client.sonar->on_sent(id, message.size());
      client.sonar->on_written(id, message, now);
      if (message.shape == nullptr) continue;
      client.pauses.insert(client.pauses.end(), message.shape->pauses.begin(), message.shape->pauses.end());
      if (message.shape->end == Outbox::Shape::End::none) continue;
      client.reset = message.shape->end == Outbox::Shape::End::reset;
      perform(*client.sonar, client.sonar->finish(id, now));
      return close(id, "a fault");
    }
    if (client.finished) close(id, client.why);
  }

  ConnectionId last_id = 0;
  std::uint32_t last_index = 0;
};

inline std::string yaml_of(const std::string& sonars, int seed = 1) {
  return "world: {scene: empty.yaml, seed: " + std::to_string(seed) +
         "}\nclock: stepped\nvehicles:\n  - {name: rov, initial_pose: {frame: ENU_FLU, xyz_m: [0, 0, "
         "-3]}}\nsonars:\n" +
         sonars;
}
inline std::string oculus_sonar(const std::string& name, const std::string& address, const std::string& more = {}) {
  return "  - name: " + name + "\n    profile: oculus-m1200d\n    bind_ip: " + address + "\n" + more;
}
inline const std::string head = "  - name: head\n    profile: blueview-p900-90\n    bind_ip: 127.0.0.3\n";

inline protocol::Bytes fire(oculus::PingRate rate = oculus::PingRate::hz10) {
  sonar::oculus::FireRequest request = sonar::oculus::stored_fire();
  request.settings.ping_rate = rate;
  request.settings.range = 10;
  return sonar::oculus::make_fire(request);
}

inline std::vector<std::uint32_t> ping_numbers(const protocol::Bytes& received) {
  sonar::oculus::Decoder decoder;
  decoder.append(received);
  std::vector<std::uint32_t> numbers;
  while (const auto message = decoder.next())
    if (const auto* ping = std::get_if<sonar::oculus::DecodedPing>(&*message)) numbers.push_back(ping->head.fixed.ping_id);
  EXPECT_EQ(decoder.skipped_bytes(), 0u);
  EXPECT_EQ(decoder.buffered_bytes(), 0u);
  return numbers;
}

}  // namespace sonar::testing_emulator
