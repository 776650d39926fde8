// The device engine's interface to a device: memory, copies and the steps of a ping. It has two implementations: CUDA, in a
// separate module that is loaded if it is installed (open_cuda_machine), and HostLoops, which runs the same bodies on the host.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "core/base/result.hpp"
#include "cuda/device_types.hpp"

namespace sonar::cuda {

/// This is thrown if the memory of the device, or the host memory for copies, is full. The device can then be used again with
/// smaller allocations.
class DeviceMemoryFull : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Lanes are queues of work. A lane keeps the order of its work; different lanes run at the same time. Failures throw
/// std::runtime_error. After such an error, except DeviceMemoryFull, the device must not be used again. Only one thread may call
/// a machine at a time, except for allocate, allocate_host and upload, which several threads that prepare pings may call at once.
class Machine {
 public:
  static constexpr int lanes = 3;
  virtual ~Machine() = default;
  virtual std::string name() const = 0;  // "NVIDIA H200, 139.8 GiB, compute 9.0"

  /// Free bytes of the device's memory at this moment. Other programs may allocate some of it.
  virtual std::size_t free_bytes() const { return std::numeric_limits<std::size_t>::max(); }
  virtual void* allocate(std::size_t bytes) = 0;  // in the device's memory
  /// For tests: if true, each piece of an arena is a separate allocation of exactly its size.
  virtual bool pieces_apart() const { return false; }
  virtual void release(void* device) = 0;
  virtual void* allocate_host(std::size_t bytes) = 0;  // host memory from which and to which copies are fast
  virtual void release_host(void* host) = 0;

  /// Queues a copy. `from` must not change before wait() for the lane has returned.
  virtual void upload(int lane, void* to_device, const void* from, std::size_t bytes) = 0;
  virtual void download(int lane, void* to, const void* from_device, std::size_t bytes) = 0;
  /// Queues steps, one after the other. For benchmarks, a timed launch measures each step separately.
  virtual void run(int lane, const Launch& launch) = 0;
  /// Returns an empty text if transform() works, else the missing part. The CPU then computes pings whose pulses need a
  /// spectrum. The first call loads the library.
  virtual std::string why_no_transforms() const = 0;
  /// Queues x[k] = sum_n x[n] e^{-+ i 2 pi k n / size} for `rows` rows of complex values, which are stored one after the other
  /// on the device. The transform is in place and not scaled. It is timed if the previous launch on the lane was timed.
  virtual void transform(int lane, double* values, int size, int rows, bool inverse) = 0;
  /// The times of the steps in timed launches since the last call. wait() for the lane must have returned before.
  virtual StepSeconds step_seconds(int lane) = 0;
  /// Makes work that is queued on `lane` from now on begin after the work that is already queued on `earlier`.
  virtual void order(int lane, int earlier) = 0;
  virtual void wait(int lane) = 0;
};

/// The order in which host loops process the indices of a step. A device uses any order. If a result depends on the order,
/// there is a race. With the two orders other than forwards, new memory has the value NaN. If a result is NaN, a step has read
/// memory that was not written.
enum class LoopOrder { forwards, backwards, scattered };
/// Makes loops on the calling thread. With them, tests run the code of the device without a device.
std::unique_ptr<Machine> make_host_loops(LoopOrder order = LoopOrder::forwards);

/// Loads the module and opens the first device. The error names the missing part and where it was searched for.
Result<std::unique_ptr<Machine>> open_cuda_machine();

}  // namespace sonar::cuda
