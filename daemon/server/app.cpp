#include "daemon/server/app.hpp"

#include <unistd.h>

#include <algorithm>
#include <csignal>

#include "daemon/emulator/world/world_parts.hpp"
#include "daemon/server/system/real_time.hpp"

namespace sonar {
namespace {

/// As stop_limit, while recordings are written. Less than the unit's TimeoutStopSec.
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
      recordings_(io_, config_, log_, compute_niceness, [this] { on_change(); }),
      changes_(
          io_, simulator_, std::move(scene), make_engine, compute_niceness,
          [this](const ScenePointer& now) {
            world_.use_objects(bodies_of(*now, config_), clock_.now());
            recordings_.use_scene(*now);
            notes_due_ = true;
          },
          [this] {
            say_new_notes();
            on_change();
          }),
      admission_(config_.limits, log_),
      pose_intake_(
          world_, clock_, log_, [this] { on_change(); }, &events_, &plausibility_),
      pose_server_(io_, config_.poses, config_.limits, admission_, pose_intake_, log_),
      mavlink_server_(io_, config_, pose_intake_, log_),
      fleet_({io_, clock_, admission_, log_, options_.digest}, config_, world_, simulator_, recordings_, events_,
             {[this] { on_change(); },
              [this](const Error& why) {
                log_.error(why.text);
                exit_code_ = exit_code(why.kind);
                stop("the engine failed");
              }}),
      operations_({config_, clock_, world_, stepped_time_, simulator_, changes_, admission_, pose_intake_, fleet_, events_,
                   recordings_, control_, mavlink_server_, plausibility_, log_, [this] { on_change(); }, options_.load_scene}),
      control_(io_, config_.control, config_.limits, admission_, operations_, events_, pose_intake_, log_),
      signals_(io_),
      house_timer_(io_),
      stop_timer_(io_),
      reload_timer_(io_),
      notify_(
          io_, options_.service_manager, [this] { return simulator_.under_way_for(); }, log_) {
  recordings_.use_scene(*changes_.scene());
  say_new_notes();
}

/// What of the configuration and the scene was probably not meant. Not before a reload has changed both.
void App::say_new_notes() {
  if (!std::exchange(notes_due_, false)) return;
  for (const Note& note : plausibility_.use(config_, *changes_.scene())) log_.warning(text_of(note));
}

Result<void> App::open() {
  if (options_.handle_signals) {  // before anybody can read that we are ready
    signals_.add(SIGINT);
    signals_.add(SIGTERM);
    signals_.add(SIGHUP);  // else it would end us at once, without a word to the clients
  }
  if (auto r = fleet_.open(config_); !r) return r;
  if (auto r = pose_server_.open(); !r) return r;
  if (auto r = mavlink_server_.open(); !r) return r;
  return control_.open();
}

int App::run() {
  if (options_.handle_signals) wait_for_signal();
  pose_server_.start();
  mavlink_server_.start();
  control_.start();
  fleet_.start();
  asio::co_spawn(
      io_, [this] { return keep_house(); }, asio::detached);
  notify_.ready(status_line());
  if (const int priority = config_.engine.io_priority; priority > 0)
    if (const std::string why = schedule_in_real_time(priority); !why.empty()) log_.warning(why);
  io_.run();
  return exit_code_;
}

/// What `systemctl status` shows.
std::string App::status_line() const {
  std::string line = "Serving";
  for (const Device& d : devices())
    line += (&d == &devices().front() ? " " : ", ") + d.config().name + " on " + text_of(d.config().bind_ip);
  return line;
}

void App::wait_for_signal() {
  signals_.async_wait([this](const error_code& ec, int signal) {
    if (ec) return;
    if (signal == SIGHUP && stopping_) {
      on_change();  // look() may have cancelled before we wait again
    } else if (signal == SIGHUP) {
      on_hangup();
    } else {
      if (stopping_) ::_exit(128 + signal);
      stop(signal == SIGINT ? "interrupted" : "terminated");
    }
    wait_for_signal();  // cancelled in look() when all is done
  });
}

void App::request_stop() {
  asio::post(io_, [this] { stop("asked to stop"); });
}

void App::stop(const std::string& why) {
  if (std::exchange(stopping_, true)) return;
  log_.info("stopping: " + why);
  notify_.stopping();
  pose_server_.stop();
  mavlink_server_.stop();
  control_.stop();
  house_timer_.cancel();
  reload_timer_.cancel();
  changes_.stop();
  fleet_.stop();
  recordings_.finish();
  // Clients have been sent away by then. What still holds us up, a long ping say, is not waited for.
  stop_timer_.expires_after(stop_limit);
  stop_timer_.async_wait([this](const error_code& ec) {
    if (ec) return;
    if (recordings_.idle()) return io_.stop();
    stop_timer_.expires_after(files_limit - stop_limit);  // pings that still wait for their file
    stop_timer_.async_wait([this](const error_code& again) {
      if (!again) io_.stop();
    });
  });
  on_change();
}

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
    // These two are the last things that keep run() from returning.
    if (fleet_.gone() && recordings_.idle()) {
      signals_.cancel();
      stop_timer_.cancel();
    }
    return;
  }
  if (clock_.stepped()) return step_time();
  if (enough_served()) stop("served " + std::to_string(options_.exit_after_pings) + " pings");
}

void App::step_time() {
  if (changes_.busy()) return;  // a change of the scene takes effect before the next step
  skip_time();
  std::list<Device>& devices = fleet_.devices();
  if (!std::all_of(devices.begin(), devices.end(), [](const Device& d) { return d.sonar().settled(); })) return;
  Device* pings = nullptr;  // next
  std::optional<Time> ping, request, talk;
  const auto is_first = [](std::optional<Time> t, std::optional<Time> of) { return t && (!of || *t < *of); };
  for (Device& d : devices) {
    if (const auto t = d.sonar().next_ping(); is_first(t, ping)) ping = t, pings = &d;
    if (const auto t = d.sonar().next_request(); is_first(t, request)) request = t;
    if (const auto t = d.sonar().next_conversation(); is_first(t, talk)) talk = t;
  }
  const std::optional<Time> for_pings = is_first(request, ping) ? request : ping;
  const SteppedTime::Bound bound = stepped_time_.bound(for_pings);
  const bool talks = is_first(talk, ping) || talk == ping;  // before the ping that is due at the same moment
  const std::optional<Time> due = talks ? talk : ping;
  // What is said at this very moment needs no time to pass.
  const bool may_come = due && (*due <= bound.last_tick || (talks && *due <= clock_.now()));
  if (!may_come && bound.then) advance_time(*bound.then);
  const bool answered = stepped_time_.answer(due);
  if (answered) on_change();  // first the answers, in turns of their own
  if (enough_served() && answered) return;
  if (enough_served()) return stop("served " + std::to_string(options_.exit_after_pings) + " pings");
  if (!may_come) return;
  advance_time(stepped_time_.tick_at(*due));
  if (talks) return on_change();  // what it made them say, or ask for, may be taken or due before the rest
  pings->step();
}

void App::advance_time(Time to) {
  clock_.advance_to(to);
  for (Device& d : fleet_.devices()) d.tick_sessions();
}

/// Stamps that we follow began, or jumped ahead.
void App::skip_time() {
  const auto skipped = world_.take_skipped();
  if (skipped.count() == 0) return;
  clock_.skip(skipped);
  for (Device& d : fleet_.devices()) d.skip(skipped);
  log_.info("time follows the poses: it jumps ahead by " + std::to_string(seconds(skipped)) + " s");
}

asio::awaitable<void> App::keep_house() {
  while (!stopping_) {
    for (const World::Stale& stale : world_.newly_stale(clock_.now())) {
      log_.warning(stale.sentence);
      if (events_.heard()) events_.tell({control::PoseEvent{stale.vehicle, true, stale.sentence}});
    }
    const std::string slow_load = operations_.slow_load();
    if (!slow_load.empty() && !slow_load_said_) log_.warning(slow_load);
    slow_load_said_ = !slow_load.empty();
    fleet_.sweep();
    for (Device& d : fleet_.devices()) d.forget_who_left();
    error_code ec;
    house_timer_.expires_after(std::chrono::milliseconds(500));
    co_await house_timer_.async_wait(into(ec));
  }
}

}  // namespace sonar
