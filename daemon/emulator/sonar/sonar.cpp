#include "daemon/emulator/sonar/sonar.hpp"

#include <algorithm>
#include <utility>

#include "core/sonar/phases.hpp"
#include "daemon/emulator/sonar/ping_request.hpp"

namespace sonar {
namespace {

constexpr auto air_reported_every = std::chrono::minutes(1);    // a vehicle on waves leaves the water with each of them
constexpr auto shortest_rhythm = std::chrono::milliseconds(1);  // between two ticks of one conversation

}  // namespace

Sonar::Sonar(Surroundings around, SonarConfig config, std::uint32_t index, Time now, std::chrono::nanoseconds skipped)
    : around_(around),
      config_(std::move(config)),
      vendor_(*config_.profile.vendor),
      index_(index),
      state_(device_state(config_, around.config, now)),
      connections_(config_),
      faults_({vendor_, connections_, config_.name, index, Seed(around.config.seed), around.journal}, now) {
  state_.skipped = skipped;
  update_depth(now);
  use_initial_settings();
}

void Sonar::report(Report::Topic topic, LogLevel level, std::string phrase, std::vector<LogField> fields,
                   Actions& actions) const {
  fields.insert(fields.begin(), {"sonar", config_.name});
  actions.emplace_back(Report{topic, {level, std::move(phrase), std::move(fields)}});
}

// ---- settings

/// Restores the state in which no client has ever connected, so that the next client finds the device as delivered.
void Sonar::use_initial_settings() {
  asked_ = false;
  asked_by_.clear();
  aim_ = {};
  protocol::ChangeSettings initial = vendor_.initial_settings(state_);
  settings_ = initial.settings;
  state_.settings = std::move(initial.vendor_settings);
  if (initial.receivers)
    if (Connection* const stream = connections_.stream(initial.receivers->stream))
      stream->receivers = {*std::move(initial.receivers)};
  // A ping that is being computed was requested with the settings of clients that have left: on_ping() drops it.
  busy_unwanted_ = busy_;
}

bool Sonar::wants_pings() const {
  return !stopping_ && connections_.has_audience() && (asked_ || vendor_.pings_before_first_request(state_));
}

void Sonar::change_settings(const protocol::ChangeSettings& change, const std::string& who, Time now, Actions& actions) {
  // Some drivers repeat their settings at ping rate: only a change is worth a line.
  const auto before = std::exchange(state_.settings, change.vendor_settings);  // equal ones may hold another state of the device
  if (!asked_ || !change.vendor_settings->equals(*before)) {
    if (!who.empty()) asked_by_ = who;  // empty: the device itself, perhaps with every ping
    report(Report::Topic::settings, who.empty() ? LogLevel::debug : LogLevel::info, "settings: " + change.summary,
           {{"client", who.empty() ? "the sonar itself" : who}}, actions);
  }
  settings_ = change.settings;  // also for a repeat, because the device's own sound speed follows its depth
  asked_ = true;
  if (change.receivers) set_receivers({}, *change.receivers, now);
  if (wants_pings()) update_pacer(now);
}

Result<Actions> Sonar::change(const protocol::SettingsOverride& wanted, const std::string& who, Time now) {
  const auto change = vendor_.apply_override(wanted, state_);
  if (!change) return tl::make_unexpected(change.error());
  Actions actions;
  change_settings(*change, who, now, actions);
  return actions;
}

bool Sonar::set_transmit(bool on) { return std::exchange(transmits_, on) != on; }

void Sonar::move_mount(const Pose& mount, Time now) {
  config_.mount = mount;
  update_depth(now);
}

void Sonar::move(const SonarConfig& config, Time now) {
  config_.vehicle = config.vehicle;
  move_mount(config.mount, now);
}

void Sonar::use_water(const Water& water, Time now) {
  state_.water = water;
  follow_water();
  if (wants_pings()) update_pacer(now);
}

/// The client's request stays. Values that the device derives from it follow the water at its depth.
void Sonar::follow_water() {
  const auto same = vendor_.apply_override({}, state_);
  if (same && same->settings.device_sound_speed_mps != settings_.device_sound_speed_mps) settings_ = same->settings;
}

DeviceFigures Sonar::figures() const {
  DeviceFigures f = figures_;
  f.ticks = pacer_.ticks();
  f.skipped = pacer_.skipped();
  f.skipped_ticks = f.skipped.total() + f.skipped_stale;
  f.clients_now = connections_.clients();
  f.clients_queued = connections_.waiting();
  for (const Connection& c : connections_.all())
    if (c.role != Role::observer) add_traffic(f, c);
  return f;
}

// ---- time

std::optional<Time> Sonar::next_ping() const {
  const auto next = pacer_.next_tick();
  return next && waits_for_pose(*next) ? std::nullopt : next;
}

bool Sonar::waits_for_pose(Time at) const {
  return around_.config.poses.on_stale == OnStale::stop && around_.world.is_stale(config_.vehicle, at);
}

std::optional<Time> Sonar::next_request() const {
  const auto next = earliest(&Connection::next_request);
  return next && waits_for_pose(*next) ? std::nullopt : next;
}

std::optional<Time> Sonar::earliest(std::optional<Time> (Connection::*of)() const) const {
  std::optional<Time> first;
  for (const Connection& c : connections_.all())
    if (const auto t = (c.*of)(); t && c.role == Role::client && c.state == Connection::State::served && (!first || *t < *first))
      first = t;
  return first ? std::optional(clock_time(*first)) : std::nullopt;
}

std::optional<Time> Sonar::next_tick() const {
  std::optional<Time> first = pacer_.next_tick();
  for (const Connection& c : connections_.all())
    if (const auto t = c.next_tick(); t && (!first || clock_time(*t) < *first)) first = clock_time(*t);
  if (const auto t = faults_.next_tick(); t && (!first || *t < *first)) first = t;
  for (const Connection& c : connections_.all())
    if (!c.held.empty() && (!first || c.held.front().until < *first)) first = c.held.front().until;
  return first;
}

Actions Sonar::on_tick(Time now) {
  // Conversations come first: a ping that one of them requests now is fired in the same tick.
  Actions actions = tick_conversations(now);
  for (Action& action : tick_pacer(now)) actions.push_back(std::move(action));
  return actions;
}

Actions Sonar::tick_conversations(Time now) {
  Actions actions;
  const Time at = unskipped(now);
  for (Connection& c : connections_.all()) {
    if (c.finishing || c.dialogue == nullptr || at < c.dialogue->next_tick()) continue;
    guarded(c, actions, [&] { handle(c, c.dialogue->on_tick(at, pacer_.trigger_waits()), now, actions); });
    c.not_before = at + shortest_rhythm;
  }
  faults_.on_tick(now);
  for (Connection& c : connections_.all()) release_held(c, now, false, actions);
  apply_fault_orders(now, actions);
  return actions;
}

Actions Sonar::tick_pacer(Time now) {
  Actions actions;
  const auto due = pacer_.next_tick();
  if (!due || now < *due) return actions;
  figures_.lateness.add(seconds(now - *due));
  if (pacer_.fire(now, busy_)) request_ping(pacer_.last_tick(), actions);
  return actions;
}

void Sonar::skip(std::chrono::nanoseconds by) {
  state_.skipped += by;
  pacer_.skip(by);
  // Stamps since power-up omit the skipped time.
  state_.powered_up_at += by;
}

bool Sonar::settled() const {
  return !busy_ && std::all_of(connections_.all().begin(), connections_.all().end(), [](const Connection& c) {
    return c.role == Role::observer || c.state != Connection::State::served || c.outbox.idle();
  });
}

// ---- pings

std::vector<protocol::Bytes> Sonar::beacons(Time now) {
  update_depth(now);
  std::vector<protocol::Bytes> datagrams;
  if (protocol::Bytes status = vendor_.beacon(state_, now); !status.empty()) datagrams.push_back(std::move(status));
  faults_.alter_beacons(datagrams, now);
  return datagrams;
}

void Sonar::update_depth(Time now) { state_.depth_m = depth_from_z(pose_at(now).position_m.z); }

/// A device may keep its rhythm while its host cannot keep up. Then pings that were not made have numbers too.
PingNumber Sonar::next_number() {
  const SkippedTicks& skipped = pacer_.skipped();
  const std::uint64_t lost = skipped.late + skipped.busy;
  const std::uint64_t since = lost - std::exchange(numbered_skips_, lost);
  if (config_.overload == Overload::count && ping_number_ > 0) ping_number_ += static_cast<std::uint32_t>(since);
  return PingNumber(state_.last_ping = ++ping_number_);
}

/// The request without its number.
PingRequest Sonar::request_at(Time at, const protocol::RequestPing& aim) const {
  const Config& config = around_.config;
  const bool stale = around_.world.is_stale(config_.vehicle, at);
  const Pose head{{}, quat_from_rpy({0, 0, aim.head_rad})};
  const Pose mount = aim.head_rad == 0 ? config_.mount : compose(config_.mount, head);
  PingRequest request = ping_request(config, around_.world, config_.vehicle, mount, at);
  request.model = state_.model;
  request.settings = settings_;
  request.vendor_settings = aim.with ? aim.with : state_.settings;
  request.sonar_id = index_;
  request.bearings = config_.bearings;
  request.switches.keep_beams = has_phases(request);
  request.blank = (stale && config.poses.on_stale == OnStale::blank) || !settings_.transmit || !transmits_;
  return request;
}

std::optional<PingRequest> Sonar::preview_request(PingNumber number, Time at) const {
  if (waits_for_pose(at)) return std::nullopt;
  const auto step = vendor_.scan_step(static_cast<std::uint32_t>(number), state_);
  PingRequest request = request_at(at, step ? step->aim : aim_);
  if (step) request.settings = step->settings;
  request.number = number;
  // The key of the noise differs from that of the sonar's pings.
  request.sonar_id = ~index_;
  return request;
}

void Sonar::request_ping(Time at, Actions& actions) {
  if (waits_for_pose(at)) {
    ++figures_.skipped_stale;
    return;
  }
  // Before the request reads the settings: the sound speed of the device follows the water at its depth.
  update_depth(at);
  follow_water();
  PingRequest request = request_at(at, aim_);
  request.number = next_number();
  request.settings.gain_db = gain_assist_.gain_db(settings_, at);
  busy_settings_ = state_.settings;
  busy_ = true;
  busy_blank_ = request.blank;
  busy_unwanted_ = false;
  actions.emplace_back(ComputePing{std::move(request)});
}

Actions Sonar::on_ping(PingOutcome outcome, Time now) {
  Actions actions;
  busy_ = false;
  ++figures_.pings;
  figures_.simulation_s += outcome.seconds;
  figures_.simulation.add(outcome.seconds);
  if (!settings_.triggered && pacer_.period().count() > 0)
    if (const auto slow = rate_watch_.look(pacer_.ticks(), pacer_.skipped().busy, outcome.seconds, 1 / seconds(pacer_.period()),
                                           around_.config.sonars.size() > 1))
      report(Report::Topic::state, LogLevel::warning, *slow, {}, actions);
  if (outcome.ping) gain_assist_.look_at(*outcome.ping);
  if (outcome.ping && !stopping_ && !busy_unwanted_ && !outcome.ping->request.blank)
    if (const auto change = vendor_.after_ping(*outcome.ping, state_)) change_settings(*change, {}, now, actions);
  if (outcome.ping) note_water(outcome.ping->request, now, actions);
  if (outcome.refused) {
    ++figures_.refused;
    report(Report::Topic::refused_ping, LogLevel::warning, "ping dropped: " + outcome.failure, {}, actions);
  } else if (!outcome.ping) {
    actions.emplace_back(EngineFailed{{outcome.kind, "sonar " + config_.name + ": the ping engine failed: " + outcome.failure}});
  } else if (!stopping_ && connections_.has_audience() && !busy_unwanted_) {
    queue_ping(outcome, now, actions);
    if (figures_.pings == 1)
      report(Report::Topic::state, LogLevel::debug, "first ping simulated", {{"ms", outcome.seconds * 1e3}}, actions);
  } else {
    ++figures_.unwanted;
  }
  return actions;
}

void Sonar::queue_ping(const PingOutcome& outcome, Time now, Actions& actions) {
  // Faults decide whether they act on this ping before it is altered, framed or offered. The calls below use these decisions.
  faults_.begin_ping(static_cast<std::uint32_t>(outcome.ping->request.number), now);
  const auto reported = faults_.altered(outcome.ping, state_, now);
  const auto bytes = vendor_.frame(*reported, state_);
  std::vector<std::pair<Connection*, protocol::Event>> events;
  PingQueued queued{outcome.ping, bytes, {}, outcome.seconds};
  for (Connection& c : connections_.all()) {
    if (c.role == Role::stream)
      offer_datagrams(c, *reported, now, queued, actions);
    else if (c.takes_datagrams())
      guarded(c, actions, [&] {
        for (protocol::Event& event : offer_to_host(c, *reported, now, queued, actions))
          events.emplace_back(&c, std::move(event));
      });
    else if (bytes != nullptr)
      guarded(c, actions, [&] {
        for (protocol::Event& event : offer(c, bytes, *reported, outcome.ping->request, now, actions))
          events.emplace_back(&c, std::move(event));
      });
  }
  state_.framed_at = reported->request.fired_at;
  // Requests that answer this ping act after all clients were offered it, because they may change the settings.
  for (const auto& [from, event] : events) on_event(source_of(*from), event, now, actions);
  actions.emplace_back(std::move(queued));
  apply_fault_orders(now, actions);
}

/// An exception loses this ping, but does not end the stream, which belongs to the device.
void Sonar::offer_datagrams(Connection& stream, const Ping& ping, Time now, PingQueued& queued, Actions& actions) {
  if (stream.finishing || receivers(stream.id).empty()) return;
  try {
    push_datagrams(stream, ping, now, queued, actions);
  } catch (const std::exception& e) {
    report_fault(e, actions);
  }
}

/// Returns what the host requests next.
std::vector<protocol::Event> Sonar::offer_to_host(Connection& host, const Ping& ping, Time now, PingQueued& queued,
                                                  Actions& actions) {
  if (host.finishing || host.state != Connection::State::served) return {};
  protocol::Delivery delivery = host.dialogue->on_ping(ping.request.vendor_settings.get(), 0, unskipped(now));
  if (!delivery.prefixes.empty()) push_datagrams(host, ping, now, queued, actions);
  return std::move(delivery.events);
}

void Sonar::push_datagrams(Connection& to, const Ping& ping, Time now, PingQueued& queued, Actions& actions) {
  std::vector<protocol::Bytes> made = vendor_.datagrams(*to.port, ping, state_);
  if (made.empty()) return;
  faults_.alter_datagrams(made, to, static_cast<std::uint32_t>(ping.request.number), now);
  if (made.empty()) return to.outbox.drop_offered(DropReason::fault);
  const auto datagrams = std::make_shared<const std::vector<protocol::Bytes>>(std::move(made));
  queued.datagrams.push_back(datagrams);
  Outbox::Message message{.bytes = nullptr,
                          .ping = static_cast<std::uint32_t>(ping.request.number),
                          .prefixes = {},
                          .fired_at = ping.request.fired_at,
                          .datagrams = datagrams};
  if (to.role == Role::client) return deliver(to, std::move(message), now, actions);
  to.outbox.push_ping(std::move(message));
  actions.emplace_back(Wake{to.id});
}

/// Returns what the client requests next.
std::vector<protocol::Event> Sonar::offer(Connection& to, const std::shared_ptr<const protocol::Bytes>& bytes,
                                          const Ping& reported, const PingRequest& ping, Time now, Actions& actions) {
  if (to.finishing || to.state != Connection::State::served) return {};
  protocol::Delivery delivery = to.dialogue->on_ping(ping.vendor_settings.get(), bytes->size(), unskipped(now));
  if (!delivery.prefixes.empty()) {
    const bool as_it_is = delivery.prefixes.size() == 1 && delivery.prefixes.front().empty();
    deliver(to,
            {.bytes = bytes,
             .ping = static_cast<std::uint32_t>(ping.number),
             .prefixes = as_it_is ? std::vector<protocol::Bytes>{} : std::move(delivery.prefixes),
             .fired_at = ping.fired_at,
             .shape = as_it_is ? parted(to, reported) : nullptr},
            now, actions);
  }
  if (to.role == Role::observer) return {};
  return std::move(delivery.events);
}

/// The pauses between the parts of a ping at a port with a gap.
std::shared_ptr<const Outbox::Shape> Sonar::parted(const Connection& to, const Ping& ping) const {
  if (to.port == nullptr || to.port->gap.count() == 0) return nullptr;
  Outbox::Shape shape;
  std::size_t end = 0;
  for (const protocol::Bytes& part : vendor_.datagrams(*to.port, ping, state_)) {
    if (end > 0) shape.pauses.push_back({end, to.port->gap});
    end += part.size();
  }
  return shape.pauses.empty() ? nullptr : std::make_shared<const Outbox::Shape>(std::move(shape));
}

/// This ping was requested like any other, and the engine computed only noise, because the sonar is above the sea surface.
void Sonar::note_water(const PingRequest& computed, Time now, Actions& actions) {
  const bool was_in_air = std::exchange(in_air_, computed.blank && !busy_blank_);
  if (!in_air_) return;
  ++figures_.out_of_water;
  if (was_in_air || (air_reported_ && now - *air_reported_ < air_reported_every)) return;
  air_reported_ = now;
  report(Report::Topic::state, LogLevel::warning,
         "the sonar is above the sea surface and receives noise only: z = 0 is the surface, lower is negative",
         {{"z_m", computed.sonar_in_world.position_m.z}}, actions);
}

}  // namespace sonar
