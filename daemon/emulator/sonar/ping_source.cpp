#include "daemon/emulator/sonar/ping_source.hpp"

#include <algorithm>

#include "core/sonar/ping.hpp"
#include "core/text/format.hpp"
#include "daemon/emulator/sonar/ping_request.hpp"

namespace sonar {
namespace {

constexpr std::uint64_t ticks_per_group = 40;
constexpr double tolerated_share = 0.1;  // tolerated fraction of skipped ticks

}  // namespace

void RateWatch::begin(std::uint64_t ticks, std::uint64_t busy, double rate_hz) {
  rate_hz_ = rate_hz;
  ticks_before_ = ticks;
  busy_before_ = busy;
  pings_ = 0;
  ping_s_ = longest_s_ = 0;
}

std::optional<std::string> RateWatch::look(std::uint64_t ticks, std::uint64_t busy, double ping_s, double rate_hz,
                                           bool has_others) {
  if (warned_ || !(rate_hz > 0)) return std::nullopt;
  if (to_pass_over_ > 0) --to_pass_over_;
  // The first pings are ignored, and a change of the rate begins a new group of ticks.
  if (to_pass_over_ > 0 || rate_hz != rate_hz_) {
    begin(ticks, busy, rate_hz);
    return std::nullopt;
  }
  ++pings_;
  ping_s_ += ping_s;
  longest_s_ = std::max(longest_s_, ping_s);
  const std::uint64_t passed = ticks - ticks_before_;
  // Ticks are evaluated in groups of 40, so that a single slow ping causes no warning.
  if (passed < ticks_per_group) return std::nullopt;
  const double skipped = static_cast<double>(busy - busy_before_) / static_cast<double>(passed);
  const double mean_s = ping_s_ / pings_, made_hz = rate_hz * (1 - skipped), alone_hz = 1 / std::max(mean_s, 1e-9);
  const double longest_s = longest_s_;
  begin(ticks, busy, rate_hz);
  if (skipped <= tolerated_share) return std::nullopt;
  warned_ = true;
  // If pings on average take less than a period, other sonars or single slow pings caused the delay.
  const bool by_itself = alone_hz < rate_hz;
  const double possible_hz = by_itself ? alone_hz : made_hz;
  const std::string why = by_itself    ? std::string()
                          : has_others ? ", and other sonars are computed in between"
                                       : text::format(", single pings up to %.0f ms", 1e3 * longest_s);
  return text::format(
      "computing takes %.0f ms per ping%s: %.*f Hz at most here, %.3g Hz are requested; ticks are skipped: request "
      "fewer beams, less range or a lower rate, or give more engine.threads",
      1e3 * mean_s, why.c_str(), possible_hz < 10 ? 1 : 0, possible_hz, rate_hz);
}

namespace {

constexpr auto air_reported_every = std::chrono::minutes(1);  // on waves, a vehicle may leave the water every few seconds

}  // namespace

PingSource::PingSource(SonarData& sonar, Audience& audience, const Faults& faults)
    : sonar_(sonar), audience_(audience), faults_(faults) {
  use_initial_settings();
}

// ---- settings

void PingSource::forget_clients() {
  if (sonar_.vendor.keeps_settings()) return drop_pings();
  use_initial_settings();
}

void PingSource::use_initial_settings() {
  asked_ = false;
  asked_by_.clear();
  protocol::ChangeSettings initial = sonar_.vendor.initial_settings(sonar_.state);
  settings_ = initial.settings;
  sonar_.state.settings = std::move(initial.vendor_settings);
  if (initial.receivers) audience_.restore_receivers(*std::move(initial.receivers));
  drop_pings();
}

void PingSource::drop_pings() {
  aim_ = {};
  // The ping that is being computed has the settings of clients that have left, so on_ping() drops it. A tick that waits for this
  // ping was due for those clients too.
  busy_unwanted_ = busy_;
  pacer_.forget_tick();
  drop_unsent();
}

void PingSource::drop_unsent() {
  sonar_.figures.unwanted += unsent_.size();
  unsent_.clear();
}

void PingSource::change_settings(const protocol::ChangeSettings& change, const std::string& who, Time now, Actions& actions) {
  // Some drivers repeat their settings with every ping, so only changes are logged. Equal settings are stored too, because they
  // may contain a different state of the device.
  const auto before = std::exchange(sonar_.state.settings, change.vendor_settings);
  if (!asked_ || !change.vendor_settings->equals(*before)) {
    if (!who.empty()) asked_by_ = who;  // empty: the device itself, which may change the settings with every ping
    sonar_.report(Report::Topic::settings, who.empty() ? LogLevel::debug : LogLevel::info, "settings: " + change.summary,
                  {{"client", who.empty() ? "the sonar itself" : who}}, actions);
  }
  settings_ = change.settings;  // also if equal, because the device's sound speed depends on the depth
  asked_ = true;
  if (change.receivers) audience_.set_receivers(nullptr, {}, *change.receivers);
  if (change.receivers || wants_pings()) update_pacer(now);
}

void PingSource::use_water(const Water& water, Time now) {
  sonar_.state.water = water;
  follow_water();
  if (wants_pings()) update_pacer(now);
}

/// Recomputes the values that the device derives from the client's request and the water at the device's depth.
void PingSource::follow_water() {
  const auto same = sonar_.vendor.apply_override({}, sonar_.state);
  if (same && same->settings.device_sound_speed_mps != settings_.device_sound_speed_mps) settings_ = same->settings;
}

// ---- faults

void PingSource::forget_settings(Time now) {
  use_initial_settings();
  update_pacer(now);
}

void PingSource::restart(bool clock_only, Time now) {
  sonar_.state.powered_up_at = now;
  pacer_.forget_tick();  // because a waiting tick is older than the restart
  if (clock_only) return;
  sonar_.state.last_ping = ping_number_ = 0;
  forget_settings(now);
}

void PingSource::override_settings(const protocol::SettingsOverride& wanted, Time now, Actions& actions) {
  if (const auto change = sonar_.vendor.apply_override(wanted, sonar_.state))
    change_settings(*change, "a fault", now, actions);
  else
    sonar_.report(Report::Topic::state, LogLevel::warning, "fault without effect: " + change.error().text, {}, actions);
}

// ---- when pings are due

/// True if the sonar runs by itself (runs_itself) or has an audience that has sent a request, if the protocol requires one.
bool PingSource::wants_pings() const {
  if (runs_itself()) return true;
  return !audience_.stopping() && audience_.has_audience() && (asked_ || sonar_.vendor.pings_before_first_request(sonar_.state));
}

void PingSource::update_pacer(Time now) {
  PingSettings paced = settings_;
  if (runs_itself()) paced.triggered = false;  // no client sends triggers
  // A fault with factor 0 stops the pings, like rate 0 (standby).
  if (const double factor = faults_.rate_factor(); factor != 1) paced.rate_hz *= static_cast<float>(factor);
  if (wants_pings())
    pacer_.configure(paced, now);
  else
    pacer_.stop();
}

void PingSource::run_itself(bool on, Time now) {
  if (std::exchange(runs_itself_, on) == on || audience_.has_audience()) return;
  if (on)
    drop_pings();
  else
    forget_clients();  // as when the last client leaves
  update_pacer(now);
}

std::optional<Time> PingSource::next_ping() const {
  const auto next = pacer_.next_tick();
  return next && waits_for_pose(*next) ? std::nullopt : next;
}

bool PingSource::waits_for_pose(Time at) const {
  return sonar_.around.config.poses.on_stale == OnStale::stop && sonar_.around.world.is_stale(sonar_.config.vehicle, at);
}

void PingSource::trigger(const protocol::RequestPing& request, Time now) {
  // A ping that is being computed also serves if it was fired with the present settings.
  if (request.joins && busy_ && busy_settings_ == sonar_.state.settings) return;
  aim_ = request;
  pacer_.trigger(now, request.joins);
}

Actions PingSource::tick(Time now) {
  Actions actions;
  const auto due = pacer_.next_tick();
  if (!due || now < *due) return actions;
  sonar_.figures.lateness.add(seconds(now - *due));
  if (pacer_.fire(now, busy_)) request_ping(pacer_.last_tick(), actions);
  return actions;
}

void PingSource::catch_up(Actions& actions) {
  if (pacer_.fire_waiting()) request_ping(pacer_.last_tick(), actions);
}

// ---- pings

/// Returns the number of the next ping. With Overload::count, pings that were skipped because of overload are numbered too.
PingNumber PingSource::next_number() {
  const SkippedTicks& skipped = pacer_.skipped();
  const std::uint64_t lost = skipped.late + skipped.busy;
  const std::uint64_t since = lost - std::exchange(numbered_skips_, lost);
  if (sonar_.config.overload == Overload::count && ping_number_ > 0) ping_number_ += static_cast<std::uint32_t>(since);
  return PingNumber(sonar_.state.last_ping = ++ping_number_);
}

/// Returns the request for a ping at a time. The caller sets the number.
PingRequest PingSource::request_at(Time at, const protocol::RequestPing& aim) const {
  const Config& config = sonar_.around.config;
  const World& world = sonar_.around.world;
  const bool stale = world.is_stale(sonar_.config.vehicle, at);
  const Pose head{{}, quat_from_rpy({0, 0, aim.head_rad})};
  const Pose mount = aim.head_rad == 0 ? sonar_.config.mount : compose(sonar_.config.mount, head);
  PingRequest request = ping_request(config, world, sonar_.config.vehicle, mount, at);
  request.model = sonar_.state.model;
  request.settings = settings_;
  request.vendor_settings = aim.with ? aim.with : sonar_.state.settings;
  request.sonar_id = sonar_.index;
  request.bearings = sonar_.config.bearings;
  request.switches.keep_beams = has_phases(request);
  request.blank = (stale && config.poses.on_stale == OnStale::blank) || !settings_.transmit || !transmits_;
  return request;
}

std::optional<PingRequest> PingSource::preview_request(PingNumber number, Time at) const {
  if (waits_for_pose(at)) return std::nullopt;
  const auto step = sonar_.vendor.scan_step(static_cast<std::uint32_t>(number), sonar_.state);
  PingRequest request = request_at(at, step ? step->aim : aim_);
  if (step) request.settings = step->settings;
  request.number = number;
  // The key of the noise differs from that of the sonar's pings.
  request.sonar_id = ~sonar_.index;
  return request;
}

void PingSource::request_ping(Time at, Actions& actions) {
  if (waits_for_pose(at)) {
    ++sonar_.figures.skipped_stale;
    return;
  }
  // The depth is set before the request reads the settings, because the device's sound speed depends on the depth.
  sonar_.update_depth(at);
  follow_water();
  PingRequest request = request_at(at, aim_);
  request.number = next_number();
  request.settings.gain_db = gain_assist_.gain_db(settings_, at);
  busy_settings_ = sonar_.state.settings;
  busy_ = true;
  busy_blank_ = request.blank;
  busy_unwanted_ = false;
  actions.emplace_back(ComputePing{std::move(request)});
}

// Updates counters, then applies changes that the device makes after a ping, then decides whether clients get the ping. Returns
// false if the ping failed, or if its audience has left; both cases are counted.
bool PingSource::on_ping(const PingOutcome& outcome, Time now, Actions& actions) {
  DeviceFigures& figures = sonar_.figures;
  busy_ = false;
  ++figures.pings;
  figures.simulation_s += outcome.seconds;
  figures.simulation.add(outcome.seconds);
  // A recording determines the pace of its pings: the next ping is requested now and arrives when it is due. Fewer beams or more
  // threads would not change the pace.
  if (outcome.recorded != nullptr && !outcome.recorded->empty()) pacer_.hurry(now);
  if (!settings_.triggered && pacer_.period().count() > 0 && outcome.recorded == nullptr)
    if (const auto slow = rate_watch_.look(pacer_.ticks(), pacer_.skipped().busy, outcome.seconds, 1 / seconds(pacer_.period()),
                                           sonar_.around.config.sonars.size() > 1))
      sonar_.report(Report::Topic::state, LogLevel::warning, *slow, {}, actions);
  // The next gain depends on this ping, even if no client gets it.
  if (outcome.ping) gain_assist_.look_at(*outcome.ping);
  // A ping for clients that have left, a ping of noise only, or a recorded ping (the settings of a recording are unknown) must
  // not change the device.
  if (outcome.ping && !audience_.stopping() && !busy_unwanted_ && !outcome.ping->request.blank && outcome.recorded == nullptr)
    if (const auto change = sonar_.vendor.after_ping(*outcome.ping, sonar_.state)) change_settings(*change, {}, now, actions);
  if (outcome.ping) note_water(outcome.ping->request, now, actions);
  if (outcome.refused) {
    ++figures.refused;
    sonar_.report(Report::Topic::refused_ping, LogLevel::warning, "ping dropped: " + outcome.failure, {}, actions);
  } else if (!outcome.ping) {
    actions.emplace_back(
        EngineFailed{{outcome.kind, "sonar " + sonar_.config.name + ": the ping engine failed: " + outcome.failure}});
  } else if (!audience_.stopping() && (audience_.has_audience() || runs_itself_) && !busy_unwanted_) {
    return true;
  } else {
    ++figures.unwanted;  // the clients left while the ping was computed
  }
  return false;
}

bool PingSource::keep_unsent(PingOutcome& outcome, Time now) {
  auto leaves = outcome.recorded == nullptr ? sonar_.vendor.leaves_at(*outcome.ping, sonar_.state) : std::nullopt;
  if (leaves && !unsent_.empty()) leaves = std::max(*leaves, unsent_.back().first);  // pings keep their order
  if (!leaves || *leaves <= now) return false;
  unsent_.emplace_back(*leaves, std::move(outcome));
  return true;
}

std::optional<Time> PingSource::next_unsent() const {
  return unsent_.empty() ? std::nullopt : std::optional(unsent_.front().first);
}

std::optional<PingOutcome> PingSource::take_unsent(Time now) {
  if (unsent_.empty() || unsent_.front().first > now) return std::nullopt;
  std::optional<PingOutcome> first = std::move(unsent_.front().second);
  unsent_.pop_front();
  return first;
}

/// Reports that the sonar is above the sea surface, where the engine computes only noise, or back in the water.
void PingSource::note_water(const PingRequest& computed, Time now, Actions& actions) {
  // A ping that was requested as noise only (`busy_blank_`) does not show whether the sonar is in the water.
  const bool was_in_air = std::exchange(in_air_, computed.blank && !busy_blank_);
  if (!in_air_) return;
  ++sonar_.figures.out_of_water;
  if (was_in_air || (air_reported_ && now - *air_reported_ < air_reported_every)) return;
  air_reported_ = now;
  sonar_.report(Report::Topic::state, LogLevel::warning,
                "the sonar is above the sea surface and receives noise only: z = 0 is the surface, lower is negative",
                {{"z_m", computed.sonar_in_world.position_m.z}}, actions);
}

}  // namespace sonar
