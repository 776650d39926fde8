#include "daemon/server/engine/simulator.hpp"

#include <unistd.h>

#include <exception>
#include <new>
#include <stdexcept>
#include <utility>

namespace sonar {
namespace {

using Steady = std::chrono::steady_clock;

double seconds_since(Steady::time_point begin) { return std::chrono::duration<double>(Steady::now() - begin).count(); }

/// Adds the findings to the ping, so that the I/O thread need not do it.
std::shared_ptr<const Ping> looked_at(Ping ping) {
  look_at(ping);
  return std::make_shared<const Ping>(std::move(ping));
}

}  // namespace

Simulator::Simulator(asio::io_context& io, std::unique_ptr<PingEngine> engine, int nice_by)
    : io_(io), description_(engine->description()), engine_(std::move(engine)) {
  engine_->set_interruption(this);
  thread_ = std::thread([this, nice_by] {
    // On Linux, niceness belongs to the thread. If setting it fails, pings may delay the I/O thread slightly.
    if (nice_by != 0 && ::nice(nice_by) == -1) {
    }
    queue_.run();
  });
}

// The thread ends when its queue is empty, so submitted jobs are computed first.
Simulator::~Simulator() {
  queue_stays_.reset();
  thread_.join();
}

/// Queues a request. The work guard in the job keeps the loop of the I/O thread running until the answer has been delivered
/// there.
void Simulator::submit(PingRequest request, Done done) {
  if (unanswered_++ == 0) begun_ = Steady::now();
  asio::post(queue_, [this, job = Job{std::move(request), std::move(done), {}, {}, asio::make_work_guard(io_)}]() mutable {
    arrive(std::move(job));
  });
}

/// Queues the change of the engine with the pings, so that the old engine computes earlier pings.
void Simulator::use(std::unique_ptr<PingEngine> engine, Retired retired) {
  description_ = engine->description();
  asio::post(queue_, [this, job = Job{{}, {}, std::move(engine), std::move(retired), asio::make_work_guard(io_)}]() mutable {
    arrive(std::move(job));
  });
}

std::chrono::nanoseconds Simulator::under_way_for() const {
  return unanswered_ == 0 ? std::chrono::nanoseconds{0} : Steady::now() - begun_;
}

// ---- the simulation thread

// Called from the queue. If run_other() or work_off() polls the queue, working_ is set and the job only waits.
void Simulator::arrive(Job job) {
  if (!job.engine) turns_.ask(job.request.sonar_id);
  waiting_.push_back(std::move(job));
  if (!working_) work_off();
}

/// `working_` prevents a second loop, because queue_.poll() below and run_other() may call arrive() while this loop runs.
void Simulator::work_off() {
  working_ = true;
  while (!waiting_.empty()) {
    if (waiting_.front().engine) {
      Job job = std::move(waiting_.front());
      waiting_.pop_front();
      change_engine(std::move(job));
      continue;
    }
    simulate(take_together());
    queue_.poll();  // adds requests that arrived meanwhile to the choice
  }
  working_ = false;
}

/// Returns the next job, and waiting jobs that the engine can compute together with it.
std::vector<Simulator::Job> Simulator::take_together() {
  std::vector<Job> jobs;
  while (!waiting_.empty() && !waiting_.front().engine) {
    const auto next = next_to_run();
    if (!jobs.empty() && jobs.size() >= engine_->most_together(jobs.front().request, next->request)) break;
    jobs.push_back(std::move(*next));
    waiting_.erase(next);
  }
  return jobs;
}

/// Returns the job for the present engine whose sonar has used the least time; among equals, the job that has waited longest.
std::list<Simulator::Job>::iterator Simulator::next_to_run() {
  auto best = waiting_.begin();
  for (auto it = waiting_.begin(); it != waiting_.end() && !it->engine; ++it)
    if (turns_.used_s(it->request.sonar_id) < turns_.used_s(best->request.sonar_id)) best = it;
  return best;
}

/// The engine calls it between two parts of a ping. Runs a ping of another sonar if that sonar has used less time, and its ping
/// takes less time than the rest of this ping.
void Simulator::run_other() {
  queue_.poll();
  if (under_way_ > 1 || waiting_.empty() || waiting_.front().engine) return;
  const auto next = next_to_run();
  if (!turns_.goes_first(next->request.sonar_id, running_, seconds_since(running_since_) - let_in_s_)) return;
  std::vector<Job> job;
  job.push_back(std::move(*next));
  waiting_.erase(next);
  const auto begin = Steady::now();
  const auto since = running_since_;
  const std::uint32_t running = running_;
  const double let_in_s = let_in_s_;
  simulate(std::move(job));
  // The call above has begun another account; the time of the interrupted ping must not include the inner ping.
  running_ = running;
  running_since_ = since;
  let_in_s_ = let_in_s + seconds_since(begin);
}

/// Computes one job, or several jobs together; each sonar is charged an equal share of the time.
void Simulator::simulate(std::vector<Job> jobs) {
  for (const Job& job : jobs) turns_.begin(job.request.sonar_id);
  running_ = jobs.front().request.sonar_id;
  running_since_ = Steady::now();
  let_in_s_ = 0;
  ++under_way_;
  std::vector<Outcome> outcomes = run(jobs);
  --under_way_;
  const double share_s = (seconds_since(running_since_) - let_in_s_) / static_cast<double>(jobs.size());
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    outcomes[i].seconds = share_s;
    turns_.end(jobs[i].request.sonar_id, share_s);
    asio::post(io_, [this, outcome = std::move(outcomes[i]), done = std::move(jobs[i].done),
                     stays = std::move(jobs[i].io_stays)]() mutable {
      --unanswered_;
      begun_ = Steady::now();
      done(std::move(outcome));
    });
  }
}

/// Returns the outcomes in the order of the jobs.
std::vector<Simulator::Outcome> Simulator::run(const std::vector<Job>& jobs) {
  if (jobs.size() == 1) return {run(jobs[0].request)};
  std::vector<Outcome> outcomes(jobs.size());
  std::vector<PingRequest> requests;
  for (const Job& job : jobs) requests.push_back(job.request);
  try {
    std::vector<Ping> pings = engine_->run(requests);
    for (std::size_t i = 0; i < jobs.size(); ++i) outcomes[i].ping = looked_at(std::move(pings.at(i)));
    return outcomes;
  } catch (const std::exception&) {  // all are computed again one by one, so that only the faulty request fails
  }
  for (std::size_t i = 0; i < jobs.size(); ++i) outcomes[i] = run(requests[i]);
  return outcomes;
}

/// Computes a ping. An invalid request, or too little memory, fails only this ping. Any other exception means that the engine has
/// failed.
Simulator::Outcome Simulator::run(const PingRequest& request) {
  Outcome outcome;
  try {
    auto pings = engine_->run({&request, 1});
    outcome.ping = looked_at(std::move(pings.at(0)));
  } catch (const std::invalid_argument& e) {
    outcome.failure = e.what();
    outcome.refused = true;
  } catch (const std::bad_alloc&) {
    outcome.failure = "out of memory";
    outcome.refused = true;
  } catch (const EngineUnavailable& e) {
    outcome.failure = e.what();
    outcome.kind = ErrorKind::unavailable;
  } catch (const std::exception& e) {
    outcome.failure = e.what();
  }
  return outcome;
}

/// Swaps the engines between two pings. `retired` gets the old engine on the I/O thread.
void Simulator::change_engine(Job job) {
  engine_->set_interruption(nullptr);
  std::swap(engine_, job.engine);
  engine_->set_interruption(this);
  asio::post(io_, [before = std::move(job.engine), retired = std::move(job.retired), stays = std::move(job.io_stays)]() mutable {
    retired(std::move(before));
  });
}

}  // namespace sonar
