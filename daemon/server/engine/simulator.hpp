// The simulation thread owns the ping engine and computes requests. Several sonars take turns according to the used time
// (FairTurns), or are computed together if that is faster (PingEngine::most_together). Requests are passed by value, and finished
// pings come back on the I/O thread; nothing else is shared.
#pragma once

#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/base/result.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "daemon/emulator/connections/actions.hpp"
#include "daemon/server/engine/fair_turns.hpp"
#include "daemon/server/system/asio.hpp"

namespace sonar {

class Simulator : private Interruption {
 public:
  using Outcome = PingOutcome;
  using Done = std::function<void(Outcome)>;
  using Retired = std::function<void(std::shared_ptr<PingEngine>)>;

  /// `nice_by` is added to the thread's niceness, as for the workers of the engine's pool.
  Simulator(asio::io_context& io, std::unique_ptr<PingEngine> engine, int nice_by);
  /// Waits until the requested pings are computed.
  ~Simulator() override;
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  /// Call it on the I/O thread, which also calls `done` and stays alive until then.
  void submit(PingRequest request, Done done);
  /// Call it on the I/O thread. `engine` gets later requests. When the previous engine has answered the earlier requests, it is
  /// passed to `retired` on the I/O thread.
  void use(std::unique_ptr<PingEngine> engine, Retired retired);
  const std::string& engine_description() const { return description_; }
  /// Call it on the I/O thread. Returns the duration of the engine's present ping so far; 0 = the engine waits for work.
  std::chrono::nanoseconds under_way_for() const;

 private:
  struct Job {
    PingRequest request;
    Done done;
    std::shared_ptr<PingEngine> engine;  // engine of a job that changes the engine
    Retired retired;
    asio::executor_work_guard<asio::io_context::executor_type> io_stays;
  };

  void arrive(Job job);
  void work_off();
  void change_engine(Job job);
  void simulate(std::vector<Job> jobs);
  std::vector<Outcome> run(const std::vector<Job>& jobs);
  Outcome run(const PingRequest& request);
  std::vector<Job> take_together();
  std::list<Job>::iterator next_to_run();
  bool expected() const override { return turns_.several(); }
  void run_other() override;

  asio::io_context& io_;
  std::string description_;
  std::size_t unanswered_ = 0;                     // requests without an answer, used only by the I/O thread
  std::chrono::steady_clock::time_point begun_{};  // time at which the engine began the oldest request

  // Only the simulation thread uses the following members.
  std::shared_ptr<PingEngine> engine_;
  std::list<Job> waiting_;
  FairTurns turns_;
  bool working_ = false;
  int under_way_ = 0;          // pings being computed, including one inside another
  double let_in_s_ = 0;        // time of pings that were computed within the present one
  std::uint32_t running_ = 0;  // sonar of the present ping
  std::chrono::steady_clock::time_point running_since_{};

  asio::io_context queue_{1};
  asio::executor_work_guard<asio::io_context::executor_type> queue_stays_{queue_.get_executor()};
  std::thread thread_;
};

}  // namespace sonar
