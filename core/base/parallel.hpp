// A fixed pool of compute threads for the loops inside the stages of a ping. core/ has no other threads. An atomic counter
// hands out the items; results must not depend on which thread processes which item.
#pragma once

#include <cstddef>
#include <memory>

namespace sonar {

class Parallel {
 public:
  /// `threads` includes the calling thread; with 1, the calling thread does all work. `nice` is added to the niceness of the
  /// workers.
  explicit Parallel(int threads = 1, int nice = 0);
  ~Parallel();
  Parallel(const Parallel&) = delete;
  Parallel& operator=(const Parallel&) = delete;

  int threads() const { return threads_; }

  /// Calls body(item, worker) once for every item in [0, count), and returns when all calls are done; worker is in [0,
  /// threads()). Only one thread may call it at a time. The first exception of a body ends the loop and is then thrown to the
  /// caller.
  template <class Body>
  void for_each(std::size_t count, Body&& body) {
    using Plain = std::remove_reference_t<Body>;
    run(count, const_cast<void*>(static_cast<const void*>(&body)),
        [](void* b, std::size_t item, int worker) { (*static_cast<Plain*>(b))(item, worker); });
  }

 private:
  using Call = void (*)(void* body, std::size_t item, int worker);
  void run(std::size_t count, void* body, Call call);

  int threads_ = 1;
  struct Pool;
  std::unique_ptr<Pool> pool_;
};

}  // namespace sonar
