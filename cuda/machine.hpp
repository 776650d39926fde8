// The device engine's interface to a device: memory, copies and the steps of a ping. Two of them: CUDA, in a module of its own
// that is loaded when there is one (open_cuda_machine), and plain loops on the host, which run the same bodies (HostLoops).
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "core/base/result.hpp"
#include "cuda/device_types.hpp"

namespace sonar::cuda {

/// The device's memory is full, or that which it shares with the computer: it works on, with less.
class DeviceMemoryFull : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Lanes are queues of work: in order within one, at the same time between two. Whatever fails throws std::runtime_error: the
/// device is not to be used again, unless that is DeviceMemoryFull. One caller at a time, except for allocate, allocate_host and
/// upload: threads that prepare pings call them at once.
class Machine {
 public:
  static constexpr int lanes = 3;
  virtual ~Machine() = default;
  virtual std::string name() const = 0;  // "NVIDIA H200, 139.8 GiB, compute 9.0"

  /// Free bytes of the device's memory at this moment; other programs may take some of it.
  virtual std::size_t free_bytes() const { return std::numeric_limits<std::size_t>::max(); }
  virtual void* allocate(std::size_t bytes) = 0;  // in the device's memory
  /// For tests: every piece that an arena hands out is an allocation of its own, of just its size.
  virtual bool pieces_apart() const { return false; }
  virtual void release(void* device) = 0;
  virtual void* allocate_host(std::size_t bytes) = 0;  // where copies to and from the device are fast
  virtual void release_host(void* host) = 0;

  /// Queued; `from` must stay as it is until the lane has been waited for.
  virtual void upload(int lane, void* to_device, const void* from, std::size_t bytes) = 0;
  virtual void download(int lane, void* to, const void* from_device, std::size_t bytes) = 0;
  /// Queues steps, one after the other. A launch that is timed is for benchmarks: each step is then timed on its own.
  virtual void run(int lane, const Launch& launch) = 0;
  /// Empty when transform() can be had; else what is missing, and pulses by way of the spectrum are the CPU's. What it takes is
  /// loaded at the first call.
  virtual std::string why_no_transforms() const = 0;
  /// Queues x[k] = sum_n x[n] e^{-+ i 2 pi k n / size} over `rows` rows of complex values, one after the other on the device, in
  /// place, not scaled. Timed when the launch before it on the lane was.
  virtual void transform(int lane, double* values, int size, int rows, bool inverse) = 0;
  /// How long each step took in the timed launches since the last call; the lane must have been waited for.
  virtual StepSeconds step_seconds(int lane) = 0;
  /// Work queued on `lane` from now on begins after the work queued on `earlier` before.
  virtual void order(int lane, int earlier) = 0;
  virtual void wait(int lane) = 0;
};

/// The order in which host loops take a step's indices. A device takes them in any: where another order makes other bytes, there
/// is a race. But forwards, memory begins with what is no number, as a device's may: where that shows, something was read
/// unwritten.
enum class LoopOrder { forwards, backwards, scattered };
/// Loops on the calling thread; for tests, which so run what the device runs.
std::unique_ptr<Machine> make_host_loops(LoopOrder order = LoopOrder::forwards);

/// Loads the module and takes the first device. The error says what is missing and where was looked.
Result<std::unique_ptr<Machine>> open_cuda_machine();

}  // namespace sonar::cuda
