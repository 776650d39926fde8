// The CUDA module: a kernel for every step, whose body is the header's, and thin calls of the runtime. Knows nothing of scenes.
#include <cuda_runtime.h>

#include <cstdio>
#include <new>

#include "cuda/cuda_module.hpp"
#include "cuda/steps.hpp"

namespace sonar::cuda {
namespace {

constexpr int lanes = 3;  // as Machine::lanes
constexpr unsigned threads_a_block = 128;
constexpr int device = 0;

struct Opened {
  cudaStream_t lane[lanes] = {};
  cudaEvent_t done[lanes] = {};
};
Opened& opened(void* machine) { return *static_cast<Opened*>(machine); }

// Index by index along x, ping by ping along y.
template <Step step>
__global__ void __launch_bounds__(threads_a_block) kernel(const PingView* views) {
  const PingView& view = views[blockIdx.y];
  const unsigned i = blockIdx.x * threads_a_block + threadIdx.x;
  if (i < step_size(step, view)) run_step<step>(view, i);
}

using Kernel = void (*)(const PingView*);
template <int... step>
Kernel kernel_of(Step wanted, std::integer_sequence<int, step...>) {
  const Kernel kernels[] = {kernel<static_cast<Step>(step)>...};
  return kernels[static_cast<int>(wanted)];
}

const char* reason(int code) { return cudaGetErrorString(static_cast<cudaError_t>(code)); }

int query(int* devices, char* name, std::size_t room) {
  *devices = 0;
  cudaError_t error = cudaGetDeviceCount(devices);
  if (error == cudaErrorNoDevice) return cudaSuccess;
  int driver = 0;
  if (error == cudaErrorInsufficientDriver && cudaDriverGetVersion(&driver) == cudaSuccess && driver == 0) {
    *devices = 0;
    std::snprintf(name, room, "no NVIDIA driver");
    return cudaSuccess;
  }
  cudaDeviceProp p;
  if (error == cudaSuccess && *devices > 0) error = cudaGetDeviceProperties(&p, device);
  if (error != cudaSuccess) {
    *devices = 0;
    return error;
  }
  if (*devices > 0)
    std::snprintf(name, room, "%s, %.1f GiB, compute %d.%d", p.name, static_cast<double>(p.totalGlobalMem) / (1u << 30), p.major,
                  p.minor);
  return cudaSuccess;
}

void close(void* machine) {
  Opened& m = opened(machine);
  for (int i = 0; i < lanes; ++i) {
    if (m.done[i]) cudaEventDestroy(m.done[i]);
    if (m.lane[i]) cudaStreamDestroy(m.lane[i]);
  }
  delete &m;
}

int open(void** machine) {
  Opened* m = new (std::nothrow) Opened;
  if (!m) return cudaErrorMemoryAllocation;
  cudaError_t error = cudaSetDevice(device);
  for (int i = 0; i < lanes && error == cudaSuccess; ++i) {
    error = cudaStreamCreateWithFlags(&m->lane[i], cudaStreamNonBlocking);
    if (error == cudaSuccess) error = cudaEventCreateWithFlags(&m->done[i], cudaEventDisableTiming);
  }
  // A kernel that this build has no code for fails here and not in the first ping.
  cudaFuncAttributes attributes;
  if (error == cudaSuccess) error = cudaFuncGetAttributes(&attributes, kernel<Step::receive>);
  if (error != cudaSuccess) {
    close(m);
    return error;
  }
  *machine = m;
  return cudaSuccess;
}

int allocate(void*, void** at, std::size_t bytes) { return cudaMalloc(at, bytes); }
int release(void*, void* at) { return cudaFree(at); }
int allocate_host(void*, void** at, std::size_t bytes) { return cudaMallocHost(at, bytes); }
int release_host(void*, void* at) { return cudaFreeHost(at); }
int upload(void* machine, int lane, void* to, const void* from, std::size_t bytes) {
  return cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, opened(machine).lane[lane]);
}
int download(void* machine, int lane, void* to, const void* from, std::size_t bytes) {
  return cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, opened(machine).lane[lane]);
}
int zero(void* machine, int lane, void* at, std::size_t bytes) {
  return cudaMemsetAsync(at, 0, bytes, opened(machine).lane[lane]);
}

int run(void* machine, int lane, int step, const PingView* views, int pings, std::uint32_t largest) {
  const Kernel k = kernel_of(static_cast<Step>(step), std::make_integer_sequence<int, static_cast<int>(Step::steps)>());
  const dim3 grid((largest + threads_a_block - 1) / threads_a_block, static_cast<unsigned>(pings));
  k<<<grid, threads_a_block, 0, opened(machine).lane[lane]>>>(views);
  return cudaGetLastError();
}

int order(void* machine, int lane, int earlier) {
  Opened& m = opened(machine);
  const cudaError_t error = cudaEventRecord(m.done[earlier], m.lane[earlier]);
  return error != cudaSuccess ? error : cudaStreamWaitEvent(m.lane[lane], m.done[earlier], 0);
}
int wait(void* machine, int lane) { return cudaStreamSynchronize(opened(machine).lane[lane]); }

const CudaModule module{module_version,
                        sizeof(PingView),
                        sizeof(TileView),
                        static_cast<std::uint32_t>(Step::steps),
                        reason,
                        query,
                        open,
                        close,
                        allocate,
                        release,
                        allocate_host,
                        release_host,
                        upload,
                        download,
                        zero,
                        run,
                        order,
                        wait};

}  // namespace
}  // namespace sonar::cuda

extern "C" __attribute__((visibility("default"))) const sonar::cuda::CudaModule* sonard_cuda_module() {
  return &sonar::cuda::module;
}
