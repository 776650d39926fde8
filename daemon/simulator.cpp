#include "daemon/simulator.hpp"

#include <unistd.h>

#include <chrono>
#include <exception>
#include <new>
#include <stdexcept>

namespace sonar {

Simulator::Simulator(asio::io_context& io, std::unique_ptr<PingEngine> engine, int nice_by)
    : io_(io), engine_(std::move(engine)), description_(engine_->description()) {
  asio::post(thread_, [nice_by] {
    // Niceness belongs to the thread on Linux; a refusal costs only smoothness.
    if (nice_by != 0 && ::nice(nice_by) == -1) return;
  });
}

Simulator::~Simulator() { thread_.join(); }

void Simulator::submit(PingRequest request, Done done) {
  if (waiting_++ == 0) begun_ = std::chrono::steady_clock::now();
  auto work = asio::make_work_guard(io_);
  asio::post(thread_, [this, work = std::move(work), request = std::move(request), done = std::move(done)]() mutable {
    Outcome outcome;
    const auto begin = std::chrono::steady_clock::now();
    try {
      auto pings = engine_->run({&request, 1});
      outcome.ping = std::make_shared<const Ping>(std::move(pings.at(0)));
    } catch (const std::invalid_argument& e) {
      outcome.failure = e.what();
      outcome.refused = true;
    } catch (const std::bad_alloc&) {
      outcome.failure = "out of memory";
      outcome.refused = true;
    } catch (const std::exception& e) {
      outcome.failure = e.what();
    }
    outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    asio::post(io_, [this, outcome = std::move(outcome), done = std::move(done)]() mutable {
      --waiting_;
      begun_ = std::chrono::steady_clock::now();
      done(std::move(outcome));
    });
  });
}

void Simulator::use(std::unique_ptr<PingEngine> engine, Retired retired) {
  description_ = engine->description();
  asio::post(thread_, [this, next = std::shared_ptr<PingEngine>(std::move(engine)), retired = std::move(retired)]() mutable {
    std::swap(engine_, next);
    asio::post(io_, [before = std::move(next), retired = std::move(retired)]() mutable { retired(std::move(before)); });
  });
}

std::chrono::nanoseconds Simulator::under_way_for() const {
  return waiting_ == 0 ? std::chrono::nanoseconds{0} : std::chrono::steady_clock::now() - begun_;
}

}  // namespace sonar
