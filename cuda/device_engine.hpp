// The ping engine that computes on a device: requests in batches, two of them under way at a time, only finished images come
// back. It works with any Machine; with host loops it is the same engine without a device.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "core/pipeline/ping_engine.hpp"
#include "cuda/machine.hpp"

namespace sonar::cuda {

/// Bytes are at most so many: of what is free on the device when the engine is made, at most two fifths are for cells and a fifth
/// for each of the two batches. When memory is full nevertheless, everything is given back and batches become half as large, in
/// the end one ping without another beside it; the engine fails when that does not fit.
struct DeviceEngineOptions {
  std::size_t cell_bytes = std::size_t{2} << 30;  // device memory for surface cells; a ping gets what it needs
  int batch = 0;                                  // pings that are launched together; 0 = 8, more with more threads, at most 32
  std::size_t work_bytes = std::size_t{1} << 30;  // memory of a batch on the device: if pings are large, a batch has fewer
  bool cpu_after_failure = true;                  // if false, a failing device is the end: run() throws EngineUnavailable
  /// Called once for each reason: what the CPU computes instead, and why. May be empty.
  std::function<void(const std::string&)> say = {};
};

/// The pool must outlive the engine. Pings that the device does not do (why_not_on_device) are computed here by the CPU; so is
/// everything from the moment the device fails, beginning with the pings that were lost, unless the options say otherwise. With a
/// clock in `options` every step is timed by the device's own, which takes a little time itself. Throws std::runtime_error when
/// the device cannot hold the scene.
std::unique_ptr<PingEngine> make_device_engine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options,
                                               std::unique_ptr<Machine> machine, DeviceEngineOptions device_options = {});

/// The part of the model that only the CPU does, as the beginning of a sentence ("pings of a fixed fan"); empty when there is
/// none. `transforms`: whether the machine has them. docs/cuda.md lists them.
std::string why_not_on_device(const PingRequest& request, bool transforms = true);

}  // namespace sonar::cuda
