#include "daemon/sonars/device.hpp"

#include <algorithm>
#include <cassert>

#include "daemon/system/listen.hpp"

namespace sonar {
namespace {

constexpr auto air_is_news_after = std::chrono::minutes(1);  // a vehicle on waves comes out of the water with each of them

protocol::DeviceState describe(const SonarConfig& config, const Water& water, Time now, bool simulated_time) {
  protocol::DeviceState s;
  s.name = config.name;
  s.id = config.device_id;
  s.model = config.profile.model;
  s.advertise_ip = config.advertise_ip;
  s.netmask = config.netmask;
  // Locally administered, so that it can belong to no real device.
  s.mac = {0x02,
           0x53,
           0x4f,
           0x00,
           static_cast<std::uint8_t>(config.device_id >> 8),
           static_cast<std::uint8_t>(config.device_id & 0xff)};
  s.powered_up_at = now;
  s.water = water;
  s.options = config.options;
  s.simulated_time = simulated_time;
  return s;
}

}  // namespace

Device::Device(DeviceContext& context, const SonarConfig& config, std::uint32_t index)
    : context_(context),
      config_(config),
      vendor_(*config.profile.vendor),
      index_(index),
      state_(describe(config, context.config.water, context.clock.now(), context.clock.stepped())),
      acceptor_(context.io),
      beacon_(context.io),
      beacon_timer_(context.io),
      ping_timer_(context.io),
      answers_(context.io, [this](protocol::BytesView datagram) { return vendor_.answer(datagram, state_); }),
      observers_(context, config_, [this] { return vendor_.converse(state_, context_.clock.lived()); }),
      visits_(context.io, context.log, config.name) {
  update_state(context.clock.now());
  use_initial_settings();
}

Device::~Device() = default;

Result<void> Device::open() {
  for (const protocol::Port& port : vendor_.ports()) {
    if (port.kind == protocol::Port::Kind::tcp_listen) {
      if (auto r = listen_tcp(acceptor_, {config_.bind_ip, port.number}); !r) return r;
    } else if (port.kind == protocol::Port::Kind::udp_answer) {
      if (auto r = answers_.open(config_, port.number); !r) return r;
    } else {
      beacon_period_ = port.period;
      for (const Endpoint& to : config_.status_to)
        status_to_.emplace_back(address_of(to.ip), to.port == 0 ? port.number : to.port);
      // An ephemeral port, but never by chance the one that drivers listen on.
      for (int attempt = 0; attempt < 8; ++attempt) {
        if (beacon_.is_open()) beacon_.close();
        if (auto r = bind_udp(beacon_, {config_.bind_ip, 0}, true); !r) return r;
        if (beacon_.local_endpoint().port() != port.number) break;
      }
    }
  }
  return observers_.open();
}

tcp::endpoint Device::data_endpoint() const {
  error_code ec;
  return acceptor_.local_endpoint(ec);
}

void Device::start() {
  started_ = true;
  keep_accepting();
  answers_.start();
  observers_.start();
  if (beacon_period_.count() > 0) keep_announcing();
}

void Device::stop(const std::string& why) {
  if (std::exchange(stopping_, true)) return;
  error_code ec;
  acceptor_.close(ec);
  beacon_timer_.cancel();
  ping_timer_.cancel();
  answers_.stop();
  visits_.end();
  observers_.stop(why);
  pacer_.stop();
  beacon_.close(ec);
  if (started_) context_.recordings.end_of(config_.name, why);  // else one of the same name may go on
  for (Waiting& waiting : queue_) waiting.socket.close(ec);
  queue_.clear();
  const auto sessions = sessions_;  // finish() may end one at once and change the list
  for (const SessionPointer& s : sessions) s->finish(why);
}

bool Device::gone() const { return sessions_.empty() && leaving_.empty() && observers_.gone() && turning_away_ == 0 && !busy_; }

// ---- settings

/// As if no client had ever spoken: the next one finds the device as it comes.
void Device::use_initial_settings() {
  asked_ = false;
  protocol::ChangeSettings initial = vendor_.initial_settings(state_);
  settings_ = initial.settings;
  state_.request = initial.request;
  requests_.clear();  // pings made with those before are nobody's
  requests_[++settings_id_] = std::move(initial.request);
  oldest_wanted_id_ = settings_id_;
}

bool Device::wants_pings() const {
  return !stopping_ && !sessions_.empty() && (asked_ || vendor_.pings_before_first_request(state_));
}

void Device::change_settings(const protocol::ChangeSettings& change, const std::string& who) {
  // Repeats arrive at ping rate from some drivers; only what the device does not already do is news.
  if (!asked_ || requests_[settings_id_] != change.request) {
    state_.request = change.request;
    requests_[++settings_id_] = change.request;
    if (!busy_) requests_.erase(requests_.begin(), requests_.find(settings_id_));
    say_at_times(context_.log, changes_, LogLevel::info, "settings: " + change.summary,
                 {{"sonar", config_.name}, {"client", who}});
  }
  settings_ = change.settings;  // of a repeat too: what the device knows by itself, its sound speed say, follows its depth
  asked_ = true;
  if (wants_pings()) pacer_.configure(settings_, context_.clock.now());
}

void Device::on_event(Session& from, const protocol::Event& event) {
  if (stopping_) return;
  if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
    change_settings(*change, from.client());
  } else if (std::holds_alternative<protocol::RequestPing>(event)) {
    // The ping under way will do only if it was fired with the settings that hold now.
    const bool joins = std::get<protocol::RequestPing>(event).joins;
    const bool served = joins && busy_ && under_way_settings_id_ == settings_id_;
    if (!served) pacer_.trigger(context_.clock.now(), joins);
  } else if (const auto* store = std::get_if<protocol::StoreAddress>(&event)) {
    state_.stored_address = store->address;
  } else if (const auto* notice = std::get_if<protocol::Notice>(&event)) {
    std::uint64_t unsaid = 0;
    if (notices_.allows(LogLimiter::Clock::now(), unsaid))
      context_.log.warning(notice->text, {{"sonar", config_.name}, {"client", from.client()}, {"unsaid", unsaid}});
    return;
  }
  arm();
  context_.on_change();
}

// ---- pings

std::optional<Time> Device::next_tick() const {
  const auto next = pacer_.next_tick();
  return next && waits_for_pose(*next) ? std::nullopt : next;
}

bool Device::waits_for_pose(Time at) const {
  return context_.config.poses.on_stale == OnStale::stop && context_.world.is_stale(config_.vehicle, at);
}

std::optional<Time> Device::next_talk() const { return earliest(&Session::next_tick); }
std::optional<Time> Device::next_wish() const {
  const auto next = earliest(&Session::next_wish);
  return next && waits_for_pose(*next) ? std::nullopt : next;
}

std::optional<Time> Device::earliest(std::optional<Time> (Session::*of)() const) const {
  std::optional<Time> first;
  for (const SessionPointer& s : sessions_)
    if (const auto t = ((*s).*of)(); t && (!first || *t < *first)) first = t;
  return first ? std::optional(context_.clock.at_lived(*first)) : std::nullopt;
}

bool Device::settled() const {
  return !busy_ && std::all_of(sessions_.begin(), sessions_.end(), [](const SessionPointer& s) { return s->idle(); });
}

/// After whatever the pacer was told.
void Device::arm() {
  state_.ping_is_owed = pacer_.trigger_waits();
  if (context_.clock.stepped()) return;
  const auto next = pacer_.next_tick();
  if (!next) {
    ping_timer_.cancel();
    return;
  }
  ping_timer_.expires_at(context_.clock.timer_at(*next));
  ping_timer_.async_wait([this](const error_code& ec) {
    if (!ec && !stopping_) on_timer();
  });
}

void Device::on_timer() {
  step(context_.clock.now());
  arm();
}

void Device::step(Time now) {
  if (const auto due = pacer_.next_tick(); due && now >= *due) figures_.lateness.add(seconds(now - *due));
  const bool fires = pacer_.fire(now, busy_);
  state_.ping_is_owed = pacer_.trigger_waits();
  if (fires) ping(pacer_.last_tick());
}

void Device::tick_sessions() {
  const auto sessions = sessions_;
  for (const SessionPointer& s : sessions) s->tick(context_.clock.lived());
  observers_.tick();
}

void Device::skip(std::chrono::nanoseconds by) {
  pacer_.skip(by);
  state_.powered_up_at += by;
}

void Device::update_state(Time now) {
  const Pose sonar = compose(context_.world.vehicle_at(config_.vehicle, now), config_.mount);
  state_.depth_m = depth_from_z(sonar.position_m.z);
}

/// A device that keeps its rhythm while its host does not keep up has numbers for the pings that were not made.
PingNumber Device::next_number() {
  const SkippedTicks& skipped = pacer_.skipped();
  const std::uint64_t lost = skipped.late + skipped.busy;
  const std::uint64_t since = lost - std::exchange(numbered_skips_, lost);
  if (config_.overload == Overload::count && ping_number_ > 0) ping_number_ += static_cast<std::uint32_t>(since);
  return PingNumber(++ping_number_);
}

void Device::ping(Time at) {
  const bool stale = context_.world.is_stale(config_.vehicle, at);
  const OnStale on_stale = context_.config.poses.on_stale;
  if (stale && on_stale == OnStale::stop) {
    ++figures_.skipped_stale;
    return context_.on_change();
  }
  update_state(at);
  PingRequest request;
  request.model = state_.model;
  request.number = next_number();
  request.fired_at = at;
  request.vehicle_in_world = context_.world.vehicle_at(config_.vehicle, at);
  request.sonar_in_world = compose(request.vehicle_in_world, config_.mount);
  request.sonar_moves = mounted_moves(context_.world.vehicle_moves(config_.vehicle, at), request.vehicle_in_world, config_.mount);
  request.bodies_in_world = context_.world.objects_at(at);
  request.water = context_.config.water;
  request.settings = settings_;
  request.settings.gain_db = gain_assist_.gain_db(settings_, at);
  request.settings_id = under_way_settings_id_ = settings_id_;
  request.sonar_id = index_;
  request.seed = Seed(context_.config.seed);
  request.blank = (stale && on_stale == OnStale::blank) || !settings_.transmit || !transmits_;
  under_way_blank_ = request.blank;
  request.switches = context_.config.engine.switches;
  request.switches.keep_truth = context_.recordings.wants_truth(config_.name);
  under_way_names_ = context_.recordings.names();
  busy_ = true;
  context_.simulator.submit(std::move(request), [this](Simulator::Outcome outcome) { on_ping(std::move(outcome)); });
}

void Device::on_ping(Simulator::Outcome outcome) {
  busy_ = false;
  ++figures_.pings;
  figures_.simulation_s += outcome.seconds;
  figures_.simulation.add(outcome.seconds);
  if (!settings_.triggered && pacer_.period().count() > 0)
    if (const auto slow = rate_watch_.look(pacer_.ticks(), pacer_.skipped().busy, outcome.seconds, 1 / seconds(pacer_.period()),
                                           context_.config.sonars.size() > 1))
      context_.log.warning(*slow, {{"sonar", config_.name}});
  if (outcome.ping) gain_assist_.look_at(*outcome.ping);
  if (outcome.ping) note_water(outcome.ping->request);
  if (outcome.refused) {
    ++figures_.refused;
    std::uint64_t unsaid = 0;
    if (refusals_.allows(LogLimiter::Clock::now(), unsaid))
      context_.log.warning("ping dropped: " + outcome.failure, {{"sonar", config_.name}, {"unsaid", unsaid}});
  } else if (!outcome.ping) {
    context_.on_failure({outcome.kind, "sonar " + config_.name + ": the ping engine failed: " + outcome.failure});
  } else if (const PingRequest& request = outcome.ping->request;
             !stopping_ && !sessions_.empty() && request.settings_id >= oldest_wanted_id_) {
    const protocol::Bytes made_with = requests_[request.settings_id];
    requests_.erase(requests_.begin(), requests_.lower_bound(request.settings_id));
    const auto bytes = vendor_.frame(*outcome.ping, state_, made_with);
    const Time now = context_.clock.now();
    std::vector<std::pair<SessionPointer, protocol::Event>> wishes;
    for (const SessionPointer& s : sessions_)
      for (protocol::Event& event : s->push_ping(bytes, request, made_with, context_.clock.lived()))
        wishes.emplace_back(s, std::move(event));
    observers_.push_ping(bytes, request, made_with);
    for (const auto& [session, event] : wishes) on_event(*session, event);
    record(outcome, bytes, now);
    tell_of_ping(*outcome.ping, outcome.seconds);
    if (figures_.pings == 1) context_.log.debug("first ping simulated", {{"sonar", config_.name}, {"ms", outcome.seconds * 1e3}});
  } else {
    ++figures_.unwanted;
  }
  context_.on_change();
}

/// The engine made noise of a ping that was asked for as any other: it knows where the sea surface is.
void Device::note_water(const PingRequest& computed) {
  const bool was_in_air = std::exchange(in_air_, computed.blank && !under_way_blank_);
  if (!in_air_) return;
  ++figures_.out_of_water;
  const auto now = std::chrono::steady_clock::now();
  if (was_in_air || (air_said_ != decltype(air_said_){} && now - air_said_ < air_is_news_after)) return;
  air_said_ = now;
  context_.log.warning("the sonar is above the sea surface and hears noise only: z = 0 is the surface, lower is negative",
                       {{"sonar", config_.name}, {"z_m", computed.sonar_in_world.position_m.z}});
}

std::vector<StreamDigest> Device::digests() const {
  auto all = digests_;
  std::sort(all.begin(), all.end(), [](const StreamDigest& a, const StreamDigest& b) { return a.client < b.client; });
  return all;
}

// ---- beacon

void Device::keep_announcing() {
  asio::co_spawn(
      context_.io, [this] { return announce(); },
      [this](std::exception_ptr fault) {
        if (!fault || stopping_) return;
        say_fault(text_of(fault));
        beacon_timer_.expires_after(beacon_period_);
        beacon_timer_.async_wait([this](const error_code& ec) {
          if (!ec && !stopping_) keep_announcing();
        });
      });
}

asio::awaitable<void> Device::announce() {
  while (!stopping_) {
    update_state(context_.clock.now());
    const protocol::Bytes status = vendor_.beacon(state_, context_.clock.now());
    for (const udp::endpoint& to : status_to_) {
      error_code ec;
      if (status.empty() || stopping_) break;
      co_await beacon_.async_send_to(asio::buffer(status), to, into(ec));
      if (stopping_) co_return;
      if (ec && !std::exchange(beacon_failed_, true))
        context_.log.warning("cannot send status: " + ec.message(), {{"sonar", config_.name}, {"to", to.address().to_string()}});
    }
    error_code ec;
    beacon_timer_.expires_after(beacon_period_);
    co_await beacon_timer_.async_wait(into(ec));
  }
}

}  // namespace sonar
