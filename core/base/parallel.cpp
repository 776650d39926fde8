#include "core/base/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <unistd.h>

namespace sonar {

struct Parallel::Pool {
  std::mutex mutex;
  std::condition_variable start, finished;
  std::vector<std::thread> workers;
  int free_places = 0;  // number of workers that may still join the current call
  int busy = 0;         // number of workers that compute
  bool stop = false;

  std::atomic<std::size_t> next{0};
  std::size_t count = 0;
  void* body = nullptr;
  Call call = nullptr;

  std::exception_ptr fault;  // the first exception of a call

  // This is also called if a worker cannot be started.
  ~Pool() {
    {
      std::lock_guard lock(mutex);
      stop = true;
    }
    start.notify_all();
    for (auto& t : workers) t.join();
  }

  /// Runs the items of the current call. Exceptions are caught, because an exception in a worker thread would end the whole
  /// program. If memory runs out in a ping, only this ping must fail.
  void run_items(int worker) {
    try {
      for (std::size_t i = next.fetch_add(1, std::memory_order_relaxed); i < count;
           i = next.fetch_add(1, std::memory_order_relaxed))
        call(body, i, worker);
    } catch (...) {
      next.store(count, std::memory_order_relaxed);  // the other workers get no more items
      std::lock_guard lock(mutex);
      if (!fault) fault = std::current_exception();
    }
  }

  void work(int worker, int nice_by) {
    // On Linux, niceness belongs to the thread. A failure is ignored, because it only makes other threads run less smoothly.
    if (nice_by != 0 && ::nice(nice_by) == -1) {
    }
    while (true) {
      {
        std::unique_lock lock(mutex);
        start.wait(lock, [&] { return stop || free_places > 0; });
        if (stop) return;
        --free_places;
        ++busy;
      }
      run_items(worker);
      {
        std::lock_guard lock(mutex);
        if (--busy == 0) finished.notify_one();
      }
    }
  }
};

Parallel::Parallel(int threads, int nice) : threads_(threads < 1 ? 1 : threads) {
  if (threads_ == 1) return;
  pool_ = std::make_unique<Pool>();
  for (int worker = 1; worker < threads_; ++worker)
    pool_->workers.emplace_back([pool = pool_.get(), worker, nice] { pool->work(worker, nice); });
}

Parallel::~Parallel() = default;

void Parallel::run(std::size_t count, void* body, Call call) {
  if (!pool_ || count < 2) {
    for (std::size_t i = 0; i < count; ++i) call(body, i, 0);
    return;
  }
  Pool& p = *pool_;
  const int places = static_cast<int>(std::min(static_cast<std::size_t>(threads_ - 1), count - 1));
  {
    std::lock_guard lock(p.mutex);
    p.count = count;
    p.body = body;
    p.call = call;
    p.next.store(0, std::memory_order_relaxed);
    p.free_places = places;
  }
  for (int i = 0; i < places; ++i) p.start.notify_one();
  p.run_items(0);
  std::unique_lock lock(p.mutex);
  p.free_places = 0;  // all items are assigned: workers that have not joined yet must not join
  p.finished.wait(lock, [&] { return p.busy == 0; });
  if (p.fault) std::rethrow_exception(std::exchange(p.fault, nullptr));
}

}  // namespace sonar
