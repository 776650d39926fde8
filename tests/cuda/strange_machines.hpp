// Devices that run on the CPU, with properties of real devices that host loops lack. One does all work as late as the order of
// lanes allows, one computes the indices of a step in parallel threads, one keeps pieces of memory apart (cuda/machine.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "cuda/machine.hpp"
#include "cuda/steps.hpp"

namespace sonar::test {

/// Host loops; derived classes change a part.
class PassingMachine : public cuda::Machine {
 public:
  std::string name() const override { return "host loops"; }
  void* allocate(std::size_t bytes) override { return inner_->allocate(bytes); }
  void release(void* device) override { inner_->release(device); }
  void* allocate_host(std::size_t bytes) override { return inner_->allocate_host(bytes); }
  void release_host(void* host) override { inner_->release_host(host); }
  void upload(int lane, void* to, const void* from, std::size_t n) override { inner_->upload(lane, to, from, n); }
  void download(int lane, void* to, const void* from, std::size_t n) override { inner_->download(lane, to, from, n); }
  void run(int lane, const cuda::Launch& launch) override { inner_->run(lane, launch); }
  std::string why_no_transforms() const override { return inner_->why_no_transforms(); }
  void transform(int lane, double* values, int size, int rows, bool inverse) override {
    inner_->transform(lane, values, size, rows, inverse);
  }
  cuda::StepSeconds step_seconds(int lane) override { return inner_->step_seconds(lane); }
  void order(int lane, int earlier) override { inner_->order(lane, earlier); }
  void wait(int lane) override { inner_->wait(lane); }

 protected:
  // With this order new memory is filled with NaN.
  std::unique_ptr<cuda::Machine> inner_ = cuda::make_host_loops(cuda::LoopOrder::backwards);
};

/// Does no work before a wait for a lane, and then only the work that this lane needs. A copy reads its source only then. So a
/// test detects a source that was changed or released too early, and a forgotten call of order().
class DeferringMachine final : public PassingMachine {
 public:
  void upload(int lane, void* to, const void* from, std::size_t n) override {
    queue(
        lane, [=, this] { inner_->upload(lane, to, from, n); }, from);
  }
  void download(int lane, void* to, const void* from, std::size_t n) override {
    queue(
        lane, [=, this] { inner_->download(lane, to, from, n); }, to);
  }
  void run(int lane, const cuda::Launch& launch) override {
    queue(lane, [=, this] { inner_->run(lane, launch); });
  }
  void transform(int lane, double* values, int size, int rows, bool inverse) override {
    queue(lane, [=, this] { inner_->transform(lane, values, size, rows, inverse); });
  }
  void order(int lane, int earlier) override {
    queue(lane, [this, earlier, until = at(earlier).begun + at(earlier).waiting.size()] { catch_up(earlier, until); });
  }
  void wait(int lane) override { catch_up(lane, at(lane).begun + at(lane).waiting.size()); }
  void release(void* device) override {  // like cudaFree, which waits for all work
    for (int lane = 0; lane < lanes; ++lane) wait(lane);
    inner_->release(device);
  }
  void* allocate_host(std::size_t bytes) override {
    void* const host = inner_->allocate_host(bytes);
    host_bytes_[static_cast<std::byte*>(host)] = bytes;
    return host;
  }
  void release_host(void* host) override {
    const auto* const begin = static_cast<std::byte*>(host);
    const auto* const end = begin + host_bytes_.at(static_cast<std::byte*>(host));
    for (Lane& lane : lanes_)
      for (Work& work : lane.waiting)
        if (work.host >= begin && work.host < end) {
          early_release_ = true;
          work.what = [] {};
        }
    inner_->release_host(host);
  }

 private:
  struct Work {
    std::function<void()> what;
    const std::byte* host;  // source or target of the copy on the host
  };
  struct Lane {
    std::deque<Work> waiting;
    std::size_t begun = 0;
  };
  Lane& at(int lane) { return lanes_.at(static_cast<std::size_t>(lane)); }
  void queue(int lane, std::function<void()> what, const void* host = nullptr) {
    at(lane).waiting.push_back({std::move(what), static_cast<const std::byte*>(host)});
  }
  void catch_up(int lane, std::size_t until) {
    while (at(lane).begun < until) {
      const Work work = std::move(at(lane).waiting.front());
      at(lane).waiting.pop_front();
      ++at(lane).begun;
      work.what();
    }
    if (std::exchange(early_release_, false)) throw std::logic_error("memory of a copy was released before the copy");
  }
  std::array<Lane, lanes> lanes_;
  std::map<std::byte*, std::size_t> host_bytes_;
  bool early_release_ = false;  // true: memory that a copy still needs was released
};

/// Distributes the indices of a step to four threads. The thread sanitizer then detects two threads that write to one position,
/// even if the result is right.
class ThreadedMachine final : public PassingMachine {
 public:
  void run(int, const cuda::Launch& launch) override {
    for (int step = launch.from; step < launch.to; ++step) {
      std::vector<std::thread> threads;
      for (std::uint32_t t = 0; t < 4; ++t)
        threads.emplace_back([&launch, step, t] {
          for (int p = 0; p < launch.pings; ++p)
            some(launch.views[p], step, t, std::make_integer_sequence<int, cuda::step_count>());
        });
      for (std::thread& thread : threads) thread.join();
    }
  }

 private:
  template <int... step>
  static void some(const cuda::PingView& view, int wanted, std::uint32_t first, std::integer_sequence<int, step...>) {
    ((wanted == step ? every_fourth<static_cast<cuda::Step>(step)>(view, first) : void()), ...);
  }
  template <cuda::Step step>
  static void every_fourth(const cuda::PingView& view, std::uint32_t first) {
    for (std::uint32_t i = first; i < cuda::step_size(step, view); i += 4) cuda::run_step<step>(view, i);
  }
};

/// Every piece of an arena is a separate allocation. The address sanitizer and valgrind then detect an index beyond the piece.
class PiecewiseMachine final : public PassingMachine {
 public:
  bool pieces_apart() const override { return true; }
};

}  // namespace sonar::test
