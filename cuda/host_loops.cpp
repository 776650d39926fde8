#include <array>
#include <chrono>
#include <cstring>
#include <new>
#include <utility>

#include "cuda/machine.hpp"
#include "cuda/steps.hpp"

namespace sonar::cuda {
namespace {

using Loop = void (*)(const PingView&, std::uint32_t size);

template <Step step>
void loop(const PingView& p, std::uint32_t size) {
  for (std::uint32_t i = 0; i < size; ++i) run_step<step>(p, i);
}
template <std::size_t... step>
constexpr std::array<Loop, sizeof...(step)> loops_of(std::index_sequence<step...>) {
  return {loop<static_cast<Step>(step)>...};
}
constexpr auto loops = loops_of(std::make_index_sequence<static_cast<std::size_t>(Step::steps)>());

constexpr std::align_val_t alignment{256};  // as the device gives it

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

class HostLoops final : public Machine {
 public:
  std::string name() const override { return "host loops"; }
  void* allocate(std::size_t bytes) override { return ::operator new(bytes, alignment); }
  void release(void* device) override { ::operator delete(device, alignment); }
  void* allocate_host(std::size_t bytes) override { return ::operator new(bytes, alignment); }
  void release_host(void* host) override { ::operator delete(host, alignment); }
  void upload(int, void* to_device, const void* from, std::size_t bytes) override { std::memcpy(to_device, from, bytes); }
  void download(int, void* to, const void* from_device, std::size_t bytes) override { std::memcpy(to, from_device, bytes); }
  void run(int lane, const Launch& launch) override {
    StepSeconds& seconds = seconds_[static_cast<std::size_t>(lane)];
    for (int step = launch.from; step < launch.to; ++step) {
      const double begin = launch.timed != 0 ? now_s() : 0;
      for (int p = 0; p < launch.pings; ++p)
        loops[static_cast<std::size_t>(step)](launch.views[p], step_size(static_cast<Step>(step), launch.views[p]));
      if (launch.timed != 0) seconds.of[step] += now_s() - begin;
    }
  }
  StepSeconds step_seconds(int lane) override { return std::exchange(seconds_[static_cast<std::size_t>(lane)], {}); }
  void order(int, int) override {}
  void wait(int) override {}

 private:
  std::array<StepSeconds, lanes> seconds_{};
};

}  // namespace

std::unique_ptr<Machine> make_host_loops() { return std::make_unique<HostLoops>(); }

}  // namespace sonar::cuda
