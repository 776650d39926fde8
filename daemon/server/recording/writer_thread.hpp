// The thread that writes recordings and the journal of faults, so that the I/O thread does not wait for a disk. Jobs run in
// order. App owns the object.
#pragma once

#include <unistd.h>

#include <exception>
#include <functional>
#include <new>
#include <string>
#include <utility>

#include "core/base/result.hpp"
#include "daemon/server/system/asio.hpp"

namespace sonar {

class WriterThread {
 public:
  /// `nice_by` is added to the niceness of the thread; `on_idle` is called after the last job, on the I/O thread.
  WriterThread(asio::io_context& io, int nice_by, std::function<void()> on_idle = {}) : io_(io), on_idle_(std::move(on_idle)) {
    asio::post(thread_, [nice_by] {
      if (nice_by != 0 && ::nice(nice_by) == -1) return;  // if this fails, the thread keeps its priority
    });
  }
  /// Waits until all jobs are done.
  ~WriterThread() { thread_.join(); }
  WriterThread(const WriterThread&) = delete;
  WriterThread& operator=(const WriterThread&) = delete;

  /// `job` runs on this thread; its Result<void> goes to `after` on the I/O thread, whose loop stays alive until then.
  void run(auto job, auto after) {
    ++under_way_;
    asio::post(thread_, [this, guard = asio::make_work_guard(io_), job = std::move(job), after = std::move(after)]() mutable {
      asio::post(io_, [this, result = attempt(job), after = std::move(after)]() mutable {
        --under_way_;
        after(result);
        if (idle() && on_idle_) on_idle_();
      });
    });
  }
  /// Runs `job` and returns its result; an exception becomes an error.
  static Result<void> attempt(auto&& job) {
    try {
      return job();
    } catch (const std::bad_alloc&) {
      return failure(ErrorKind::unavailable, "not enough memory to record");
    } catch (const std::exception& e) {
      return failure(ErrorKind::bug, std::string("writing failed: ").append(e.what()));
    }
  }
  /// True if no job runs or waits.
  bool idle() const { return under_way_ == 0; }

 private:
  asio::io_context& io_;
  std::function<void()> on_idle_;
  std::size_t under_way_ = 0;
  asio::thread_pool thread_{1};
};

}  // namespace sonar
