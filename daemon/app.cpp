#include "daemon/app.hpp"

#include <unistd.h>

#include <algorithm>
#include <csignal>

#include "daemon/real_time.hpp"

namespace sonar {
namespace {

World make_world(const Config& config, const Scene& scene, Time start) {
  PoseRules rules;
  rules.extrapolate_max = nanoseconds_from(config.poses.extrapolate_max_s);
  rules.stale_after = nanoseconds_from(config.poses.stale_after_s);
  rules.max_jump_m = config.poses.max_jump_m;
  rules.stepped = config.clock == ClockMode::stepped;
  std::vector<BodyStart> vehicles, objects;
  for (const VehicleConfig& v : config.vehicles) vehicles.push_back({v.name, v.initial_pose, v.orbits});
  for (std::size_t i = 0; i < scene.body_names.size(); ++i)
    objects.push_back({scene.body_names[i], scene.bodies_in_world.at(i), false});
  return World(rules, std::move(vehicles), std::move(objects), start);
}

}  // namespace

App::App(Config config, std::shared_ptr<const Scene> scene, const EngineFactory& make_engine, AppOptions options, Log& log)
    : config_(std::move(config)),
      scene_(std::move(scene)),
      options_(options),
      log_(log),
      clock_(config_.clock == ClockMode::stepped),
      world_(make_world(config_, *scene_, clock_.now())),
      simulator_(io_, make_engine(scene_), compute_niceness),
      admission_(config_.limits, log_),
      pose_server_(io_, config_.poses, world_, clock_, log_, [this] { on_change(); }),
      context_{io_,
               clock_,
               world_,
               simulator_,
               admission_,
               log_,
               config_,
               options_.digest,
               [this] { on_change(); },
               [this](const std::string& why) {
                 log_.error(why);
                 exit_code_ = exit_code(ErrorKind::bug);
                 stop("the engine failed");
               }},
      signals_(io_),
      house_timer_(io_),
      notify_(
          io_, options_.service_manager, [this] { return simulator_.under_way_for(); }, log_) {
  for (std::size_t i = 0; i < config_.sonars.size(); ++i)
    devices_.emplace_back(context_, config_.sonars[i], static_cast<std::uint32_t>(i));
}

Result<void> App::open() {
  if (options_.handle_signals) {  // before anybody can read that we are ready
    signals_.add(SIGINT);
    signals_.add(SIGTERM);
    signals_.add(SIGHUP);  // else it would end us at once, without a word to the clients
  }
  for (Device& d : devices_)
    if (auto r = d.open(); !r) return r;
  return pose_server_.open();
}

int App::run() {
  if (options_.handle_signals) wait_for_signal();
  pose_server_.start();
  for (Device& d : devices_) d.start();
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
  for (const Device& d : devices_)
    line += (&d == &devices_.front() ? " " : ", ") + d.config().name + " on " + text_of(d.config().bind_ip);
  return line;
}

void App::wait_for_signal() {
  signals_.async_wait([this](const error_code& ec, int signal) {
    if (ec) return;
    if (signal == SIGHUP) {
      log_.info("SIGHUP: reload is not in this version; nothing changed");
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
  house_timer_.cancel();
  for (Device& d : devices_) d.stop();
  on_change();
}

void App::on_change() {
  if (std::exchange(look_posted_, true)) return;
  asio::post(io_, [this] {
    look_posted_ = false;
    look();
  });
}

bool App::enough_served() const {
  if (options_.exit_after_pings == 0) return false;
  std::uint64_t served = 0;
  for (const Device& d : devices_) served += d.figures().served;
  return served >= options_.exit_after_pings;
}

void App::look() {
  if (stopping_) {
    // The signal handler is the last thing that keeps run() from returning.
    if (std::all_of(devices_.begin(), devices_.end(), [](const Device& d) { return d.gone(); })) signals_.cancel();
    return;
  }
  if (clock_.stepped()) return step_time();
  if (enough_served()) stop("served " + std::to_string(options_.exit_after_pings) + " pings");
}

void App::step_time() {
  if (!std::all_of(devices_.begin(), devices_.end(), [](const Device& d) { return d.settled(); })) return;
  if (enough_served()) return stop("served " + std::to_string(options_.exit_after_pings) + " pings");
  Device* next = nullptr;
  for (Device& d : devices_)
    if (d.next_tick() && (next == nullptr || *d.next_tick() < *next->next_tick())) next = &d;
  if (next == nullptr) return;
  clock_.advance_to(*next->next_tick());
  for (Device& d : devices_) d.tick_sessions(clock_.now());
  next->step(clock_.now());
}

asio::awaitable<void> App::keep_house() {
  while (!stopping_) {
    for (const std::string& sentence : world_.newly_stale(clock_.now())) log_.warning(sentence);
    error_code ec;
    house_timer_.expires_after(std::chrono::milliseconds(500));
    co_await house_timer_.async_wait(into(ec));
  }
}

}  // namespace sonar
