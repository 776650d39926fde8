// A whole daemon in a thread of this process, like that of `sonard run`, for cases with clients on loopback.
#pragma once

#include <pthread.h>
#include <unistd.h>

#include <ctime>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "daemon/server/app.hpp"
#include "daemon/server/engine/choose_engine.hpp"
#include "daemon/server/system/real_time.hpp"
#include "tests/bench/measure.hpp"

namespace sonar::bench {

/// Returns an address in one of the networks 127.64..127.191, chosen by the process id.
inline std::string own_address(int sonar = 0) {
  const auto process = static_cast<unsigned>(::getpid());
  return "127." + std::to_string(64 + process / 250 % 128) + "." + std::to_string(1 + process % 250) + "." +
         std::to_string(99 + sonar);
}

class Service {
 public:
  /// `wrap` may wrap the daemon's engine in another one.
  using Wrap = std::function<std::unique_ptr<PingEngine>(std::unique_ptr<PingEngine>)>;
  static Result<std::unique_ptr<Service>> start(Config config, ScenePointer scene, const BenchOptions& options, Wrap wrap = {}) {
    auto service = std::unique_ptr<Service>(new Service(std::move(config), std::move(scene), options, std::move(wrap)));
    if (auto opened = service->app_.open(); !opened) return tl::make_unexpected(opened.error());
    service->thread_ = std::thread([app = &service->app_] { app->run(); });
    return service;
  }
  ~Service() { stop(); }
  void stop() {
    app_.request_stop();
    if (thread_.joinable()) thread_.join();
  }
  /// Returns the processor time of the thread that sends.
  double sender_s() {
    clockid_t clock{};
    timespec t{};
    if (::pthread_getcpuclockid(thread_.native_handle(), &clock) != 0 || ::clock_gettime(clock, &t) != 0) return 0;
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }
  App& app() { return app_; }
  /// Returns the figures of the first sonar. Call it after stop().
  DeviceFigures figures() const { return app_.devices().front().figures(); }

 private:
  Service(Config config, ScenePointer scene, const BenchOptions& options, Wrap wrap)
      : pool_(options.threads.back(), compute_niceness),
        log_(errors_only()),
        app_(
            std::move(config), std::move(scene),
            [this, engine = options.engine, wrap = std::move(wrap)](ScenePointer s) {
              auto made = choose_engine(engine.device, std::move(s), pool_, {.simd = engine.simd}, {});
              return wrap ? wrap(std::move(made)) : std::move(made);
            },
            {}, log_) {}

  static LogOptions errors_only() {
    LogOptions options;
    options.level = LogLevel::error;
    return options;
  }

  Parallel pool_;
  Log log_;
  App app_;
  std::thread thread_;
};

}  // namespace sonar::bench
