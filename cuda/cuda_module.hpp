// The interface between the program and the CUDA module. Another compiler builds the module, and the program loads it by name.
// The interface is plain C. The program checks the version and the sizes of the structs. cuda_machine.cpp calls the interface,
// cuda_module.cu implements it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/device_types.hpp"

namespace sonar::cuda {

inline constexpr std::uint32_t module_version = 7;  // version of this file, of device_types.hpp and of the steps
inline constexpr const char* module_file = "libsonard_cuda.so";
inline constexpr const char* module_entry = "sonard_cuda_module";

/// Calls whose result has no other meaning return 0, or a code that `reason` explains. `machine` is the result of open.
struct CudaModule {
  std::uint32_t version, view_bytes, tile_bytes, steps;
  const char* (*reason)(int code);
  /// 1 if the code means that memory is full. After any other code the machine cannot be used.
  int (*is_memory_full)(int code);
  /// Returns the number of devices and the name of the first: "NVIDIA H200, 139.8 GiB, compute 9.0". Without a device, the name
  /// is the reason, or empty.
  int (*query)(int* devices, char* name, std::size_t room);
  int (*open)(void** machine);
  void (*close)(void* machine);
  int (*free_bytes)(void* machine, std::size_t* bytes);
  int (*allocate)(void* machine, void** device, std::size_t bytes);
  int (*release)(void* machine, void* device);
  int (*allocate_host)(void* machine, void** host, std::size_t bytes);
  int (*release_host)(void* machine, void* host);
  int (*upload)(void* machine, int lane, void* to_device, const void* from, std::size_t bytes);
  int (*download)(void* machine, int lane, void* to, const void* from_device, std::size_t bytes);
  int (*run)(void* machine, int lane, const Launch* launch);
  /// Returns 1 if cuFFT is present, else 0. `name` gets its version, or the name of the missing file. Needs no machine.
  int (*transforms)(char* name, std::size_t room);
  int (*transform)(void* machine, int lane, void* values, int size, int rows, int inverse);
  int (*step_seconds)(void* machine, int lane, StepSeconds* seconds);
  int (*order)(void* machine, int lane, int earlier);
  int (*wait)(void* machine, int lane);
};
using CudaModuleEntry = const CudaModule* (*)();

}  // namespace sonar::cuda
