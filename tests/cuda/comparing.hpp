// The device engine and the CPU engine over one scene, and the difference of two pings.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "cuda/cuda_engine.hpp"
#include "cuda/device_engine.hpp"

namespace sonar::test {

/// Returns the machine of these tests' engine: host loops or, in programs compiled for it, the device.
#ifdef SONAR_TEST_ON_DEVICE
inline Result<std::unique_ptr<cuda::Machine>> test_machine() {
  setenv("SONARD_CUDA_MODULE", SONAR_TEST_ON_DEVICE,
         0);  // the value of the environment has priority, because a packed test lies elsewhere
  return cuda::open_cuda_machine();
}
#else
inline Result<std::unique_ptr<cuda::Machine>> test_machine() { return cuda::make_host_loops(); }
#endif
/// Every test begins with this macro.
#define SKIP_WITHOUT_A_MACHINE() \
  if (const auto machine = sonar::test::test_machine(); !machine) GTEST_SKIP() << "CUDA: " << machine.error().text

/// The CPU engine and the device engine over one scene.
class BothEngines {
 public:
  explicit BothEngines(std::shared_ptr<const Scene> scene, SimdLevel simd = SimdLevel::portable, int batch = 8)
      : cpu_(make_cpu_engine(scene, pool_, {.simd = simd})) {
    cuda::DeviceEngineOptions options;
    options.batch = batch;
    options.say = [this](const std::string& what) { said.push_back(what); };
    device_ = cuda::make_device_engine(scene, pool_, {.simd = simd}, test_machine().value(), options);
  }
  Ping by_cpu(const PingRequest& r) { return cpu_->run({&r, 1}).at(0); }
  Ping by_device(const PingRequest& r) { return device_->run({&r, 1}).at(0); }
  std::vector<Ping> by_device(const std::vector<PingRequest>& r) { return device_->run(r); }
  PingEngine& cpu() { return *cpu_; }
  PingEngine& device() { return *device_; }
  std::vector<std::string> said;

 private:
  Parallel pool_{2};
  std::unique_ptr<PingEngine> cpu_, device_;
};

struct Apart {
  double relative_l2 = 0;       // difference of the beams' signals, or of pressures if those are not kept
  std::uint32_t most_lsb = 0;   // largest difference of two samples
  std::size_t samples_off = 0;  // number of samples that differ
  bool shape = true, truth = true;
};

inline double relative_l2(const float* a, const float* b, std::size_t n) {
  double apart = 0, all = 0;
  for (std::size_t i = 0; i < n; ++i) {
    apart += std::pow(static_cast<double>(a[i]) - static_cast<double>(b[i]), 2);
    all += std::pow(static_cast<double>(a[i]), 2);
  }
  return all > 0 ? std::sqrt(apart / all) : std::sqrt(apart);
}

inline Apart compare(const Ping& a, const Ping& b) {
  Apart d;
  d.shape = a.samples.size() == b.samples.size() && a.row_gain == b.row_gain && a.beam_azimuth_rad == b.beam_azimuth_rad &&
            a.pressure_upa.size() == b.pressure_upa.size() && a.beam_signal_upa.size() == b.beam_signal_upa.size();
  if (!d.shape) return d;
  if (!a.beam_signal_upa.empty())
    d.relative_l2 = relative_l2(reinterpret_cast<const float*>(a.beam_signal_upa.data()),
                                reinterpret_cast<const float*>(b.beam_signal_upa.data()), 2 * a.beam_signal_upa.size());
  else
    d.relative_l2 = relative_l2(a.pressure_upa.data(), b.pressure_upa.data(), a.pressure_upa.size());
  const auto bytes = static_cast<std::size_t>(a.request.settings.format.bits / 8);
  for (std::size_t i = 0; i + bytes <= a.samples.size(); i += bytes) {
    std::uint32_t x = 0, y = 0;
    std::memcpy(&x, &a.samples[i], bytes);
    std::memcpy(&y, &b.samples[i], bytes);
    d.most_lsb = std::max(d.most_lsb, x > y ? x - y : y - x);
    d.samples_off += x != y ? 1 : 0;
  }
  d.truth = a.truth.size() == b.truth.size();
  for (std::size_t j = 0; d.truth && j < a.truth.size(); ++j)
    d.truth = a.truth[j].object == b.truth[j].object && std::abs(a.truth[j].range_m - b.truth[j].range_m) < 1e-3f;
  return d;
}

}  // namespace sonar::test
