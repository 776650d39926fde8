#include <array>
#include <chrono>
#include <cstring>
#include <map>
#include <new>
#include <numeric>
#include <utility>

#include "core/pipeline/pulses/spectral_transform.hpp"
#include "cuda/machine.hpp"
#include "cuda/steps.hpp"

namespace sonar::cuda {
namespace {

using Loop = void (*)(const PingView&, std::uint32_t size, LoopOrder order);

/// A stride that reaches every index once: about the number of indices divided by the golden ratio.
std::uint64_t stride_over(std::uint64_t size) {
  // The stride must be coprime to the size.
  std::uint64_t stride = size * 5 / 8 + 1;
  while (std::gcd(stride, size) != 1) ++stride;
  return stride;
}

template <Step step>
void loop(const PingView& p, std::uint32_t size, LoopOrder order) {
  // The indices of a step must not depend on each other. Then results are equal in every order.
  if (order == LoopOrder::forwards)
    for (std::uint32_t i = 0; i < size; ++i) run_step<step>(p, i);
  if (order == LoopOrder::backwards)
    for (std::uint32_t i = size; i-- > 0;) run_step<step>(p, i);
  if (order != LoopOrder::scattered || size == 0) return;
  const std::uint64_t stride = stride_over(size);
  for (std::uint64_t k = 0, i = 0; k < size; ++k, i = (i + stride) % size) run_step<step>(p, static_cast<std::uint32_t>(i));
}
template <std::size_t... step>
constexpr std::array<Loop, sizeof...(step)> loops_of(std::index_sequence<step...>) {
  return {loop<static_cast<Step>(step)>...};
}
constexpr auto loops = loops_of(std::make_index_sequence<static_cast<std::size_t>(Step::steps)>());

constexpr std::align_val_t host_alignment{256};  // as on the device

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

class HostLoops final : public Machine {
 public:
  explicit HostLoops(LoopOrder order) : order_(order) {}
  std::string name() const override { return "host loops"; }
  void* allocate(std::size_t bytes) override {
    void* const at = ::operator new(bytes, host_alignment);
    // Every float is set to NaN, so that a read before a write is visible in results.
    if (order_ != LoopOrder::forwards) std::memset(at, 0xFF, bytes);
    return at;
  }
  void release(void* device) override { ::operator delete(device, host_alignment); }
  void* allocate_host(std::size_t bytes) override { return ::operator new(bytes, host_alignment); }
  void release_host(void* host) override { ::operator delete(host, host_alignment); }
  void upload(int, void* to_device, const void* from, std::size_t bytes) override { std::memcpy(to_device, from, bytes); }
  void download(int, void* to, const void* from_device, std::size_t bytes) override { std::memcpy(to, from_device, bytes); }
  void run(int lane, const Launch& launch) override {
    StepSeconds& seconds = seconds_[static_cast<std::size_t>(lane)];
    for (int step = launch.from; step < launch.to; ++step) {
      const double begin = launch.timed != 0 ? now_s() : 0;
      for (int p = 0; p < launch.pings; ++p)
        loops[static_cast<std::size_t>(step)](launch.views[p], step_size(static_cast<Step>(step), launch.views[p]), order_);
      if (launch.timed != 0) seconds.of[step] += now_s() - begin;
    }
  }
  std::string why_no_transforms() const override { return spectral::have_transform ? "" : "no FFTW"; }
  void transform(int lane, double* values, int size, int rows, bool inverse) override {
    const double begin = now_s();
    using spectral::Fft;
    const auto [at, made] = fft_.try_emplace({size, inverse}, size, inverse ? Fft::Direction::inverse : Fft::Direction::forward);
    for (int row = 0; row < rows; ++row)  // an array of complex numbers may be read as an array of doubles, and vice versa
      at->second.run(reinterpret_cast<spectral::Complex*>(values) + static_cast<std::ptrdiff_t>(row) * size);
    seconds_[static_cast<std::size_t>(lane)].transforms += now_s() - begin;
  }
  StepSeconds step_seconds(int lane) override { return std::exchange(seconds_[static_cast<std::size_t>(lane)], {}); }
  void order(int, int) override {}
  void wait(int) override {}

 private:
  LoopOrder order_;
  std::array<StepSeconds, lanes> seconds_{};
  std::map<std::pair<int, bool>, spectral::Fft> fft_;
};

}  // namespace

std::unique_ptr<Machine> make_host_loops(LoopOrder order) { return std::make_unique<HostLoops>(order); }

}  // namespace sonar::cuda
