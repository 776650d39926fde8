// The simulation thread owns the ping engine and computes requests. Several sonars take turns according to the used time
// (FairTurns), or are computed together if that is faster (PingEngine::most_together). Requests are passed by value, and finished
// pings come back on the I/O thread; nothing else is shared.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/base/result.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "daemon/emulator/connections/actions.hpp"
#include "daemon/server/system/asio.hpp"

namespace sonar {

// Chooses the next ping if several sonars share one engine: the ping of the sonar with the least used computing time. Also
// decides whether a ping may start before the present one is finished. Callers pass the times.

class FairTurns {
 public:
  /// Call it when a sonar requests a ping. A sonar that was idle gets no advantage from its idle time.
  void ask(std::uint32_t sonar) {
    Account& a = accounts_[sonar];
    a.used_s = std::max(a.used_s, floor_s_);
  }
  /// Call it when a ping of the sonar begins.
  void begin(std::uint32_t sonar) { floor_s_ = std::max(floor_s_, accounts_[sonar].used_s); }
  /// Call it when a ping of the sonar is finished. `seconds`: time that the engine took.
  void end(std::uint32_t sonar, double seconds) {
    Account& a = accounts_[sonar];
    a.used_s += seconds;
    a.last_s = seconds;
    ++a.pings;
  }
  double used_s(std::uint32_t sonar) const {
    const auto it = accounts_.find(sonar);
    return it == accounts_.end() ? 0 : it->second.used_s;
  }
  bool several() const { return accounts_.size() > 1; }

  /// True if a ping of `other` should be computed before the rest of a ping of `running`, which has taken `elapsed_s` so far.
  /// The condition is that `other` has used less time, and that its ping takes less time than the rest.
  bool goes_first(std::uint32_t other, std::uint32_t running, double elapsed_s) const {
    const auto a = accounts_.find(other), b = accounts_.find(running);
    if (a == accounts_.end() || b == accounts_.end() || a->second.pings == 0 || b->second.pings == 0) return false;
    const bool had_less = a->second.used_s < b->second.used_s + elapsed_s;
    return had_less && a->second.last_s < b->second.last_s - elapsed_s;
  }

 private:
  struct Account {
    double used_s = 0, last_s = 0;
    std::uint64_t pings = 0;
  };
  std::map<std::uint32_t, Account> accounts_;
  double floor_s_ = 0;  // used_s that the sonar of the last begun ping had at the beginning of the ping
};

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
