// The ping engine that computes on a device. It processes requests in batches, two at a time, and copies only finished images
// back. It works with any Machine. With host loops the same engine runs without a device.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "core/pipeline/ping_engine.hpp"
#include "cuda/machine.hpp"

namespace sonar::cuda {

/// Sizes are upper limits. At most two fifths of the device memory that is free at the start are used for cells, and at most a
/// fifth for each of the two batches. If memory is full nevertheless, the engine releases all of it and halves the batches,
/// down to one batch of one ping. If this batch does not fit, the engine fails.
struct DeviceEngineOptions {
  std::size_t cell_bytes = std::size_t{2} << 30;  // device memory for surface cells; a single ping may exceed it
  int batch = 0;                                  // pings that are launched together; 0 = the number of threads, but 8 to 32
  std::size_t work_bytes = std::size_t{1} << 30;  // device memory of a batch; if pings are large, a batch has fewer
  bool cpu_after_failure = true;                  // false: run() and collect() throw EngineUnavailable if the device fails
  /// The engine calls it with a text for users when the CPU computes pings instead of the device (once for each reason), or when
  /// batches become smaller. May be empty.
  std::function<void(const std::string&)> say = {};
};

/// Makes the engine. The pool must outlive it. The CPU computes pings that the device cannot compute (why_not_on_device). After
/// a failure of the device, the CPU computes the lost pings and all later ones, unless the options state otherwise. With a
/// clock in `options` the device measures the time of every step, which itself takes a little time. Throws std::runtime_error
/// if the scene does not fit on the device.
std::unique_ptr<PingEngine> make_device_engine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options,
                                               std::unique_ptr<Machine> machine, DeviceEngineOptions device_options = {});

/// The part of the request's model that only the CPU can compute, as the beginning of a sentence ("pings of a fixed fan");
/// empty if there is none. `transforms`: true if the machine has Fourier transforms. docs/cuda.md lists these parts.
std::string why_not_on_device(const PingRequest& request, bool transforms = true);

}  // namespace sonar::cuda
