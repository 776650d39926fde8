// The simulation thread: one thread that owns the ping engine and computes one request after the other.
// Requests go over by value, finished pings come back on the I/O thread; nothing else is shared.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "core/pipeline/ping_engine.hpp"
#include "daemon/asio.hpp"

namespace sonar {

class Simulator {
 public:
  struct Outcome {
    std::shared_ptr<const Ping> ping;  // null on failure
    std::string failure;
    bool refused = false;  // only this ping could not be made: it is invalid or there was no memory for it
    double seconds = 0;    // of wall time it took
  };
  using Done = std::function<void(Outcome)>;
  using Retired = std::function<void(std::shared_ptr<PingEngine>)>;

  /// `nice_by` is added to the thread's niceness, as for the workers of the engine's pool.
  Simulator(asio::io_context& io, std::unique_ptr<PingEngine> engine, int nice_by);
  /// Waits for the ping under way.
  ~Simulator();
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  /// I/O thread. `done` is called there; the I/O thread stays alive until it was.
  void submit(PingRequest request, Done done);
  /// I/O thread. Requests submitted from now on go to `engine`; the one before comes back through `retired`, called on the I/O
  /// thread, when it has answered those before.
  void use(std::unique_ptr<PingEngine> engine, Retired retired);
  const std::string& engine_description() const { return description_; }
  /// I/O thread: for how long the engine has been at its present ping; 0 = it waits for work.
  std::chrono::nanoseconds under_way_for() const;

 private:
  asio::io_context& io_;
  std::shared_ptr<PingEngine> engine_;  // the simulation thread's
  std::string description_;
  std::size_t waiting_ = 0;                        // requests without an answer; I/O thread, as the next
  std::chrono::steady_clock::time_point begun_{};  // when the engine took up the oldest of them
  asio::thread_pool thread_{1};
};

}  // namespace sonar
