#include "daemon/server/app.hpp"

#include <unistd.h>

#include <csignal>
#include <utility>

#include "core/text/format.hpp"
#include "daemon/config/products.hpp"
#include "daemon/config/restart_keys.hpp"
#include "daemon/emulator/world/world_parts.hpp"
#include "daemon/server/system/real_time.hpp"

namespace sonar {
namespace {

/// Replaces stop_limit while files are being written. It is less than TimeoutStopSec of the systemd unit.
constexpr std::chrono::milliseconds files_limit{8000};

}  // namespace

App::App(Config config, std::shared_ptr<const Scene> scene, const EngineFactory& make_engine, AppOptions options, Log& log)
    : config_(std::move(config)),
      options_(std::move(options)),
      log_(log),
      clock_(config_.clock != ClockMode::realtime),
      world_(pose_rules(config_), vehicles_of(config_), bodies_of(*scene, config_), clock_.now()),
      stepped_time_(config_.clock, clock_, world_),
      simulator_(io_, make_engine(scene), compute_niceness),
      writer_(io_, background_niceness,
              [this] {
                if (stopping_) on_change();
              }),
      recordings_(writer_, config_, log_, [this] { on_change(); }),
      changes_(
          io_, simulator_, std::move(scene), make_engine, background_niceness,
          [this](const ScenePointer& now) {
            world_.use_objects(bodies_of(*now, config_), clock_.now());
            recordings_.use_scene(*now);
            notes_due_ = true;
          },
          [this] {
            log_new_notes();
            on_change();
          }),
      admission_(config_.limits, log_),
      pose_intake_(
          world_, clock_, log_, [this] { on_change(); }, &events_, &plausibility_),
      pose_server_(io_, config_.poses, config_.limits, admission_, pose_intake_, log_),
      mavlink_server_(io_, config_, pose_intake_, log_, clock_.now()),
      fault_log_(events_, recordings_, writer_, log_),
      fleet_({io_, clock_, admission_, log_, options_.digest}, config_, world_, simulator_, recordings_, events_, fault_log_,
             {[this] { on_change(); },
              [this](const Error& why) {
                log_.error(why.text);
                exit_code_ = exit_code(why.kind);
                stop("the engine failed");
              },
              [this](const SonarConfig& of, const PingQueued& ping) { mavlink_server_.on_distance(of, ping); }}),
      stepper_(clock_, world_, stepped_time_, fleet_, log_, [this] { on_change(); }),
      scene_operations_(config_, changes_, pose_intake_, events_, log_, options_.load_scene),
      sonar_operations_(config_, fleet_, recordings_, log_),
      time_operations_(stepped_time_, pose_intake_, fleet_, [this] { on_change(); }),
      monitoring_({config_, clock_, world_, changes_, fleet_, simulator_, admission_, recordings_, plausibility_, mavlink_server_,
                   control_, fault_log_, view_}),
      fault_operations_(config_, fleet_, fault_log_, clock_, log_),
      operations_(scene_operations_, sonar_operations_, time_operations_, monitoring_, fault_operations_),
      view_({io_, config_, clock_, world_, changes_, fleet_, operations_, log_}),
      control_(io_, config_.control, config_.limits, admission_, operations_, events_, pose_intake_, log_, &view_),
      signals_(io_),
      housekeeping_timer_(io_),
      stop_timer_(io_),
      notify_(
          io_, options_.service_manager, [this] { return simulator_.under_way_for(); }, log_),
      reload_(io_, changes_, log_, reload_steps()) {
  mavlink_server_.inject_failures_with([this](std::uint32_t unit, mavlink::FailureType type, std::uint32_t instance) {
    return fault_operations_.inject(unit, type, instance);
  });
  mavlink_server_.on_distances_wanted([this] { run_range_finders(); });
  changes_.pace_while([this] { return !clock_.stepped() && fleet_.has_clients(); });
  recordings_.use_scene(*changes_.scene());
  log_new_notes();
}

/// Logs probable mistakes in configuration and scene. Call it when a reload has replaced both.
void App::log_new_notes() {
  if (!std::exchange(notes_due_, false)) return;
  for (const Note& note : plausibility_.use(config_, *changes_.scene())) log_.warning(text_of(note));
}

/// Opens control last, so that no request arrives before all sonars are open.
Result<void> App::open() {
  if (options_.handle_signals) {  // set before sonard reports that it is ready
    signals_.add(SIGINT);
    signals_.add(SIGTERM);
    signals_.add(SIGHUP);  // the default action of SIGHUP would end the process in the middle of messages
  }
  if (!config_.faults.journal.empty())
    if (auto r = fault_log_.open(config_.faults.journal); !r) return r;
  recordings_.find_earlier();
  if (auto r = fleet_.open(config_); !r) return r;
  if (auto r = pose_server_.open(); !r) return r;
  if (auto r = mavlink_server_.open(); !r) return r;
  return control_.open();
}

int App::run() {
  if (options_.handle_signals) wait_for_signal();
  pose_server_.start();
  control_.start();
  fleet_.start();
  mavlink_server_.start();
  fault_operations_.begin_plan();
  asio::co_spawn(
      io_, [this] { return housekeeping(); }, asio::detached);
  notify_.ready(status_line());
  if (const int priority = config_.engine.io_priority; priority > 0)
    if (const std::string why = schedule_in_real_time(priority); !why.empty()) log_.warning(why);
  io_.run();
  return exit_code_;
}

/// Returns the line that `systemctl status` shows.
std::string App::status_line() const {
  std::string line = "Serving";
  for (const Device& d : devices())
    line += (&d == &devices().front() ? " " : ", ") + d.config().name + " on " + text_of(d.config().bind_ip);
  return line;
}

/// Handles signals: SIGHUP reloads, the first SIGINT or SIGTERM stops gracefully, the second one ends the process.
void App::wait_for_signal() {
  signals_.async_wait([this](const error_code& ec, int signal) {
    if (ec) return;
    if (signal == SIGHUP && stopping_) {
      on_change();  // look() may have cancelled the signals before this handler waits again
    } else if (signal == SIGHUP) {
      reload_.request();
    } else {
      if (stopping_) ::_exit(128 + signal);
      stop(signal == SIGINT ? "interrupted" : "terminated");
    }
    wait_for_signal();  // look() cancels it when all is done
  });
}

void App::request_stop() {
  asio::post(io_, [this] { stop("stop requested"); });
}

/// Closes the servers first, so that no request arrives while sonars finish their connections.
void App::stop(const std::string& why) {
  if (std::exchange(stopping_, true)) return;
  log_.info("stopping: " + why);
  notify_.stopping();
  hurry_all_threads();
  pose_server_.stop();
  mavlink_server_.stop();
  control_.stop();
  view_.stop();
  housekeeping_timer_.cancel();
  reload_.stop();
  changes_.stop();
  fleet_.stop();
  recordings_.finish();
  // After stop_limit all clients are finished. Other work, such as a long computation, is abandoned.
  stop_timer_.expires_after(stop_limit);
  stop_timer_.async_wait([this](const error_code& ec) {
    if (ec) return;
    if (files_are_written()) return io_.stop();
    stop_timer_.expires_after(files_limit - stop_limit);  // recorded pings are still being written
    stop_timer_.async_wait([this](const error_code& again) {
      if (!again) io_.stop();
    });
  });
  on_change();
}

/// Requests a look(); many changes in one turn of the event loop cause only one call.
void App::on_change() {
  if (std::exchange(look_posted_, true)) return;
  asio::post(io_, [this] {
    look_posted_ = false;
    look();
  });
}

bool App::enough_served() const { return options_.exit_after_pings != 0 && fleet_.served() >= options_.exit_after_pings; }

void App::look() {
  if (stopping_) {
    // After these two calls nothing prevents run() from returning.
    if (fleet_.gone() && files_are_written()) {
      signals_.cancel();
      stop_timer_.cancel();
    }
    return;
  }
  // A change of the scene takes effect before the next step.
  const bool may_end = clock_.stepped() ? !changes_.busy() && stepper_.step([this] { return enough_served(); }) : enough_served();
  if (may_end) stop("served " + std::to_string(options_.exit_after_pings) + " pings");
}

Reload::Steps App::reload_steps() {
  return {.begin = [this] { notify_.reloading(); },
          .read_config = options_.read_config,
          .load_scene = options_.load_scene,
          .take_over = [this](Config next) { take_over(std::move(next)); },
          .end = [this] { notify_.ready(status_line()); }};
}

/// Runs in one turn of the event loop, so that no request uses half of the new configuration.
void App::take_over(Config next) {
  const std::vector<std::string> keys = keep_restart_keys(config_, next);
  const bool other_water = !(config_.water == next.water);
  std::swap(config_, next);  // devices read config_ through their context
  const Config& before = next;
  // The World is updated before the fleet, because moved and new sonars look up their vehicle in it.
  world_.use_rules(pose_rules(config_));
  world_.use_vehicles(vehicles_of(config_), clock_.now());
  world_.use_objects(bodies_of(scene(), config_), clock_.now());
  world_.show_again();
  notes_due_ = true;
  const Fleet::Change change = fleet_.take_over(before, config_);
  if (other_water)
    for (Device& d : fleet_.devices()) d.use_water(config_.water);
  for (const Device* opened : change.opened) fault_operations_.begin_plan(opened);
  run_range_finders();

  for (const std::string& error : change.errors) log_.error("reload: " + error);
  if (!keys.empty()) log_.warning("reload: these need a restart and stay as they were: " + text::joined(keys));
  for (const std::string& note : notes_of_config(config_)) log_.info("reload: " + note);
  log_.info("reloaded: " + change.summary, {{"scene", scene().name}});
  events_.publish_scene(config_.scene.name(), "reloaded: " + change.summary);
  on_change();
}

/// Lets range finders ping without clients while an autopilot gets their distances.
void App::run_range_finders() {
  for (Device& d : fleet_.devices())
    if (d.sonar().vendor().measures_distance())
      d.run_itself(mavlink_server_.wants_distances(config_.vehicles[d.config().vehicle].name));
}

asio::awaitable<void> App::housekeeping() {
  while (!stopping_) {
    for (const World::Stale& stale : world_.newly_stale(clock_.now())) {
      log_.warning(stale.sentence);
      events_.publish_pose(stale.vehicle, true, stale.sentence);
    }
    const std::string slow_load = monitoring_.slow_load();
    if (!slow_load.empty() && !slow_load_logged_) log_.warning(slow_load);
    slow_load_logged_ = !slow_load.empty();
    const std::vector<Note> on_clock = monitoring_.notes_on_clock();
    if (!on_clock.empty() && !clock_note_logged_) log_.warning(text_of(on_clock.front()));
    clock_note_logged_ = !on_clock.empty();
    fleet_.sweep();
    for (Device& d : fleet_.devices()) d.forget_who_left();
    error_code ec;
    housekeeping_timer_.expires_after(std::chrono::milliseconds(500));
    co_await housekeeping_timer_.async_wait(into(ec));
  }
}

}  // namespace sonar
