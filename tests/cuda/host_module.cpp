// A module like that of nvcc, but with host loops as the device. With it the shipped programs do everything that they do with a
// CUDA device, from the search for the module to the last image. SONARD_TEST_DEVICE_LASTS=N makes the device fail at the Nth
// call. SONARD_TEST_DEVICE_IDLE=1 omits its steps, so that only the processor's part of a ping limits the rate.
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "cuda/cuda_module.hpp"
#include "tests/cuda/failing_machine.hpp"

namespace sonar::cuda {
namespace {

struct Opened {
  explicit Opened(int lasts) : machine(calls, lasts) {}
  int calls = 0;
  bool idle = std::getenv("SONARD_TEST_DEVICE_IDLE") != nullptr;
  test::FailingMachine machine;
};
Machine& machine_of(void* opened) { return static_cast<Opened*>(opened)->machine; }

constexpr int memory_full = 2;

template <class Call>
int code_of(const Call& call) {
  try {
    call();
    return 0;
  } catch (const DeviceMemoryFull&) {
    return memory_full;
  } catch (const std::exception&) {
    return 1;
  }
}

const char* reason(int code) { return code == memory_full ? "out of memory" : "the device is lost"; }
int is_memory_full(int code) { return code == memory_full ? 1 : 0; }
int query(int* devices, char* name, std::size_t room) {
  *devices = 1;
  std::snprintf(name, room, "host loops");
  return 0;
}
int open(void** machine) {
  const char* lasts = std::getenv("SONARD_TEST_DEVICE_LASTS");
  *machine = new Opened(lasts ? std::atoi(lasts) : INT_MAX);
  return 0;
}
void close(void* machine) { delete static_cast<Opened*>(machine); }
int free_bytes(void* m, std::size_t* bytes) {
  return code_of([&] { *bytes = machine_of(m).free_bytes(); });
}
int allocate(void* m, void** at, std::size_t bytes) {
  return code_of([&] { *at = machine_of(m).allocate(bytes); });
}
int release(void* m, void* at) {
  return code_of([&] { machine_of(m).release(at); });
}
int allocate_host(void* m, void** at, std::size_t bytes) {
  return code_of([&] { *at = machine_of(m).allocate_host(bytes); });
}
int release_host(void* m, void* at) {
  return code_of([&] { machine_of(m).release_host(at); });
}
int upload(void* m, int lane, void* to, const void* from, std::size_t bytes) {
  return code_of([&] { machine_of(m).upload(lane, to, from, bytes); });
}
int download(void* m, int lane, void* to, const void* from, std::size_t bytes) {
  return code_of([&] { machine_of(m).download(lane, to, from, bytes); });
}
int run(void* m, int lane, const Launch* launch) {
  if (static_cast<Opened*>(m)->idle) return 0;
  return code_of([&] { machine_of(m).run(lane, *launch); });
}
int transforms(char* name, std::size_t room) {
  std::snprintf(name, room, "FFTW");
  return make_host_loops()->why_no_transforms().empty() ? 1 : 0;
}
int transform(void* m, int lane, void* values, int size, int rows, int inverse) {
  return code_of([&] { machine_of(m).transform(lane, static_cast<double*>(values), size, rows, inverse != 0); });
}
int step_seconds(void* m, int lane, StepSeconds* seconds) {
  return code_of([&] { *seconds = machine_of(m).step_seconds(lane); });
}
int order(void* m, int lane, int earlier) {
  return code_of([&] { machine_of(m).order(lane, earlier); });
}
int wait(void* m, int lane) {
  return code_of([&] { machine_of(m).wait(lane); });
}

const CudaModule module{module_version,
                        sizeof(PingView),
                        sizeof(TileView),
                        static_cast<std::uint32_t>(Step::steps),
                        reason,
                        is_memory_full,
                        query,
                        open,
                        close,
                        free_bytes,
                        allocate,
                        release,
                        allocate_host,
                        release_host,
                        upload,
                        download,
                        run,
                        transforms,
                        transform,
                        step_seconds,
                        order,
                        wait};

}  // namespace
}  // namespace sonar::cuda

extern "C" __attribute__((visibility("default"))) const sonar::cuda::CudaModule* sonard_cuda_module() {
  return &sonar::cuda::module;
}
