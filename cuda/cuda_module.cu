// The CUDA module: one kernel for each step, whose body is in cuda/steps.hpp, and functions that call the CUDA runtime. The
// module contains no code for scenes.
#include <cuda_runtime.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <thread>
#include <vector>

#include "cuda/cuda_module.hpp"
#include "cuda/cufft_library.hpp"
#include "cuda/graph_shelf.hpp"
#include "cuda/patience.hpp"
#include "cuda/steps.hpp"

namespace sonar::cuda {
namespace {

constexpr int lanes = 3;  // equals Machine::lanes
constexpr int device = 0;

constexpr std::size_t most_transforms = 8;
constexpr int timed_things = step_count + 2;  // the steps, the forward and the inverse transforms

struct Transform {
  int size, rows;
  CufftLibrary::Handle plan;
};
struct Lane {
  cudaStream_t stream = nullptr;
  cudaEvent_t done = nullptr;
  GraphShelf<cudaGraphExec_t> graphs;
  std::vector<Transform> transforms;  // most recent first; lanes do not share them, because a plan runs one transform at a time
  cudaEvent_t begin[timed_things] = {}, end[timed_things] = {};  // made when a launch is first timed
  bool timed[timed_things] = {};                                 // since the last call of step_seconds
  bool timing = false;                                           // the last launch was timed
};
struct Opened {
  Lane lane[lanes];
  bool graphs_work = true;  // false once a graph has failed; launches then use no graphs
  // True if a wait took too long. A further call that waits for the device might never return. Therefore no such call is made,
  // and no memory is released.
  bool hung = false;
};
Opened& opened(void* machine) { return *static_cast<Opened*>(machine); }

/// Like cudaStreamSynchronize, but with a time limit.
cudaError_t wait_for_stream(Opened& m, cudaStream_t stream) {
  if (m.hung) return cudaErrorLaunchTimeout;
  const auto now = [] { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); };
  const cudaError_t error = wait_for(
      cudaErrorNotReady, cudaErrorLaunchTimeout, [&] { return cudaStreamQuery(stream); }, now,
      [] { std::this_thread::sleep_for(std::chrono::microseconds(200)); });
  m.hung = error == cudaErrorLaunchTimeout;
  return error;
}

// Blocks along x cover the indices of a step; blocks along y are pings.
template <Step step>
__global__ void __launch_bounds__(threads_a_block) kernel(const PingView* views) {
  const PingView& view = views[blockIdx.y];
  const unsigned i = blockIdx.x * threads_a_block + threadIdx.x;  // at most 2^32 - 1: see blocks_for
  if (i < step_size(step, view)) run_step<step>(view, i);
}

using Kernel = void (*)(const PingView*);
template <int... step>
Kernel kernel_of(Step wanted, std::integer_sequence<int, step...>) {
  const Kernel kernels[] = {kernel<static_cast<Step>(step)>...};
  return kernels[static_cast<int>(wanted)];
}

const char* reason(int code) {
  return code >= cufft_codes ? CufftLibrary::reason(code) : cudaGetErrorString(static_cast<cudaError_t>(code));
}

int is_memory_full(int code) {
  return code == cudaErrorMemoryAllocation || (code >= cufft_codes && CufftLibrary::is_memory_full(code)) ? 1 : 0;
}

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
  for (Lane& l : m.lane) {
    if (l.stream) wait_for_stream(m, l.stream);
    if (m.hung) return;  // the rest is released when the program ends
    for (auto& entry : l.graphs.entries())
      if (entry.graph) cudaGraphExecDestroy(entry.graph);
    for (const Transform& t : l.transforms) cufft().destroy(t.plan);
    for (int step = 0; step < timed_things; ++step) {
      if (l.begin[step]) cudaEventDestroy(l.begin[step]);
      if (l.end[step]) cudaEventDestroy(l.end[step]);
    }
    if (l.done) cudaEventDestroy(l.done);
    if (l.stream) cudaStreamDestroy(l.stream);
  }
  delete &opened(machine);
}

int open(void** machine) {
  Opened* m = new (std::nothrow) Opened;
  if (!m) return cudaErrorMemoryAllocation;
  cudaError_t error = cudaSetDevice(device);
  for (Lane& l : m->lane) {
    if (error == cudaSuccess) error = cudaStreamCreateWithFlags(&l.stream, cudaStreamNonBlocking);
    if (error == cudaSuccess) error = cudaEventCreateWithFlags(&l.done, cudaEventDisableTiming);
  }
  // If this build has no code for the device, a kernel fails here and not in the first ping.
  cudaFuncAttributes attributes;
  if (error == cudaSuccess) error = cudaFuncGetAttributes(&attributes, kernel<Step::receive>);
  if (error != cudaSuccess) {
    close(m);
    return error;
  }
  // For measurements, 0 switches graphs off. A graph makes launches faster, but a launch that differs needs a new capture.
  const char* graphs = std::getenv("SONARD_CUDA_GRAPHS");
  m->graphs_work = !graphs || std::strcmp(graphs, "0") != 0;
  *machine = m;
  return cudaSuccess;
}

/// Returns `error` and clears the last error of the thread. Otherwise the runtime would report it again for the next launch.
cudaError_t cleared(cudaError_t error) {
  if (error != cudaSuccess) cudaGetLastError();
  return error;
}
int free_bytes(void*, std::size_t* bytes) {
  std::size_t all = 0;
  return cleared(cudaMemGetInfo(bytes, &all));
}
int allocate(void*, void** at, std::size_t bytes) { return cleared(cudaMalloc(at, bytes)); }
int release(void* machine, void* at) { return opened(machine).hung ? cudaErrorLaunchTimeout : cudaFree(at); }
int allocate_host(void*, void** at, std::size_t bytes) { return cleared(cudaMallocHost(at, bytes)); }
int release_host(void* machine, void* at) { return opened(machine).hung ? cudaErrorLaunchTimeout : cudaFreeHost(at); }
int upload(void* machine, int lane, void* to, const void* from, std::size_t bytes) {
  return cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, opened(machine).lane[lane].stream);
}
int download(void* machine, int lane, void* to, const void* from, std::size_t bytes) {
  return cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, opened(machine).lane[lane].stream);
}
cudaError_t launch_step(cudaStream_t stream, int step, const GraphKey& what) {
  cudaGetLastError();  // clears an error that another engine left on this thread
  const Kernel k = kernel_of(static_cast<Step>(step), std::make_integer_sequence<int, step_count>());
  k<<<dim3(what.blocks[step], static_cast<unsigned>(what.pings)), threads_a_block, 0, stream>>>(what.views);
  return cudaGetLastError();
}
cudaError_t launch_plainly(cudaStream_t stream, const GraphKey& what) {
  cudaError_t error = cudaSuccess;
  for (int step = what.from; step < what.to && error == cudaSuccess; ++step)
    if (what.blocks[step] > 0) error = launch_step(stream, step, what);
  return error;
}

/// Captures the launch as a graph; null if the capture fails. In either case the capture of the stream has ended.
cudaGraphExec_t capture(cudaStream_t stream, const GraphKey& what) {
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t made = nullptr;
  // Captures only this thread, because other engines may allocate on their threads at the same time.
  if (cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal) == cudaSuccess) {
    const cudaError_t launched = launch_plainly(stream, what);
    const cudaError_t ended = cudaStreamEndCapture(stream, &graph);
    if (launched == cudaSuccess && ended == cudaSuccess && graph && cudaGraphInstantiateWithFlags(&made, graph, 0) != cudaSuccess)
      made = nullptr;
  }
  if (graph) cudaGraphDestroy(graph);
  if (!made) cudaGetLastError();  // clears the error, so that the next launch does not report it
  return made;
}

cudaError_t launch_by_graph(Opened& m, Lane& lane, const GraphKey& what) {
  cudaGraphExec_t dropped = nullptr;
  auto& entry = lane.graphs.look_up(what, dropped);
  if (dropped) {
    if (const cudaError_t error = wait_for_stream(m, lane.stream)) return error;  // the device may still use it
    cudaGraphExecDestroy(dropped);
  }
  // A capture must not load kernels. Therefore earlier launches without a graph must have loaded all of them.
  if (!entry.graph && entry.seen > 1) {
    entry.graph = capture(lane.stream, what);
    m.graphs_work = entry.graph != nullptr;
  }
  return entry.graph ? cudaGraphLaunch(entry.graph, lane.stream) : launch_plainly(lane.stream, what);
}

/// Begins the timing of a step or of the transforms, unless it has already begun.
cudaError_t begin_timing(Lane& lane, int what) {
  cudaError_t error = cudaSuccess;
  if (!lane.begin[what]) error = cudaEventCreate(&lane.begin[what]);
  if (error == cudaSuccess && !lane.end[what]) error = cudaEventCreate(&lane.end[what]);
  if (error == cudaSuccess && !lane.timed[what]) error = cudaEventRecord(lane.begin[what], lane.stream);
  return error;
}
cudaError_t end_timing(Lane& lane, int what) {
  const cudaError_t error = cudaEventRecord(lane.end[what], lane.stream);
  lane.timed[what] = error == cudaSuccess;
  return error;
}

cudaError_t launch_timed(Lane& lane, const GraphKey& what) {
  cudaError_t error = cudaSuccess;
  for (int step = what.from; step < what.to && error == cudaSuccess; ++step) {
    if (what.blocks[step] == 0) continue;
    error = begin_timing(lane, step);
    if (error == cudaSuccess) error = launch_step(lane.stream, step, what);
    if (error == cudaSuccess) error = end_timing(lane, step);
  }
  return error;
}

int run(void* machine, int lane, const Launch* launch) {
  Opened& m = opened(machine);
  Lane& l = m.lane[lane];
  const GraphKey what(*launch);
  l.timing = launch->timed != 0;
  if (launch->timed != 0) return launch_timed(l, what);
  return m.graphs_work ? launch_by_graph(m, l, what) : launch_plainly(l.stream, what);
}

int transforms(char* name, std::size_t room) {
  cufft().describe(name, room);
  return cufft().loaded() ? 1 : 0;
}

/// Finds or makes the lane's plan for this size, which becomes the most recently used one. A plan is kept, because making it
/// allocates memory and may wait for the device.
int transform_for(Opened& m, Lane& lane, int size, int rows, CufftLibrary::Handle* plan) {
  std::vector<Transform>& all = lane.transforms;
  std::size_t i = 0;
  while (i < all.size() && (all[i].size != size || all[i].rows != rows)) ++i;
  if (i == all.size()) {
    if (i == most_transforms) {
      if (const cudaError_t error = wait_for_stream(m, lane.stream)) return error;  // the device may still use it
      cufft().destroy(all.back().plan);
      all.pop_back();
    }
    Transform made{size, rows, {}};
    if (const int code = cufft().make(&made.plan, size, rows, lane.stream)) return code;
    all.push_back(made);
    i = all.size() - 1;
  }
  const Transform found = all[i];
  for (; i > 0; --i) all[i] = all[i - 1];
  all[0] = found;
  *plan = found.plan;
  return 0;
}

int transform(void* machine, int lane, void* values, int size, int rows, int inverse) {
  Lane& l = opened(machine).lane[lane];
  CufftLibrary::Handle plan;
  if (const int code = transform_for(opened(machine), l, size, rows, &plan)) return code;
  const int what = step_count + (inverse != 0 ? 1 : 0);
  if (l.timing)
    if (const cudaError_t error = begin_timing(l, what)) return error;
  if (const int code = cufft().run(plan, values, inverse != 0)) return code;
  return l.timing ? end_timing(l, what) : cudaSuccess;
}

int step_seconds(void* machine, int lane, StepSeconds* seconds) {
  Lane& l = opened(machine).lane[lane];
  *seconds = StepSeconds{};
  for (int step = 0; step < timed_things; ++step) {
    if (!l.timed[step]) continue;
    l.timed[step] = false;
    float ms = 0;
    const cudaError_t error = cudaEventElapsedTime(&ms, l.begin[step], l.end[step]);
    if (error != cudaSuccess) return error;
    (step < step_count ? seconds->of[step] : seconds->transforms) += 1e-3 * static_cast<double>(ms);
  }
  return cudaSuccess;
}

int order(void* machine, int lane, int earlier) {
  Lane& before = opened(machine).lane[earlier];
  const cudaError_t error = cudaEventRecord(before.done, before.stream);
  return error != cudaSuccess ? error : cudaStreamWaitEvent(opened(machine).lane[lane].stream, before.done, 0);
}
int wait(void* machine, int lane) { return wait_for_stream(opened(machine), opened(machine).lane[lane].stream); }

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
