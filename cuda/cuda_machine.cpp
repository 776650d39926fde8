// A machine that uses the CUDA module. The module is searched for beside the program and in the folder where it is installed.
#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "cuda/cuda_module.hpp"
#include "cuda/cuda_status.hpp"
#include "cuda/machine.hpp"

namespace sonar::cuda {
namespace {

namespace fs = std::filesystem;

/// Paths of the module: only SONARD_CUDA_MODULE if it is set; else beside the program, then the lib folder of the installation.
std::vector<fs::path> module_places() {
  if (const char* given = std::getenv("SONARD_CUDA_MODULE")) return {given};
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  // Without /proc, the search path of the loader is used.
  if (error) return {module_file};
  const fs::path folder = program.parent_path();
  return {folder / module_file, folder.parent_path() / "lib" / "sonard" / module_file};
}

struct Loaded {
  const CudaModule* module = nullptr;
  std::string why_not;  // "not installed", or the error of the module
};

/// Loads the module. If it is already loaded, this takes little time.
Loaded load() {
  for (const fs::path& place : module_places()) {
    std::error_code error;
    if (!fs::exists(place, error)) continue;
    // The module is never unloaded, because its runtime has threads and handlers.
    void* library = dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!library) return {nullptr, std::string("not loadable: ") + dlerror()};
    const auto entry = reinterpret_cast<CudaModuleEntry>(dlsym(library, module_entry));
    const CudaModule* module = entry ? entry() : nullptr;
    // Structs are passed as bytes. Therefore their sizes must agree, not only the version.
    if (!module || module->version != module_version || module->view_bytes != sizeof(PingView) ||
        module->tile_bytes != sizeof(TileView) || module->steps != static_cast<std::uint32_t>(Step::steps))
      return {nullptr, place.string() + " belongs to another version of sonard"};
    return {module, ""};
  }
  return {nullptr, "not installed"};
}

struct Found {
  const CudaModule* module = nullptr;
  int devices = 0;
  std::string status;  // see cuda_status()
};
Found find_device() {
  const Loaded loaded = load();
  const CudaModule* module = loaded.module;
  if (!module) return {nullptr, 0, loaded.why_not};
  // The name of the device, or the reason why there is none.
  std::array<char, 256> name{};
  Found found{module, 0, ""};
  const int code = module->query(&found.devices, name.data(), name.size());
  if (code != 0)
    found.status = std::string("no device (") + module->reason(code) + ")";
  else
    found.status = found.devices > 0 ? name.data() : name[0] != 0 ? std::string("no device (") + name.data() + ")" : "no device";
  return found;
}

class CudaMachine final : public Machine {
 public:
  CudaMachine(const CudaModule& module, std::string name) : module_(module), name_(std::move(name)) { check(module_.open(&at_)); }
  ~CudaMachine() override {
    if (at_) module_.close(at_);
  }
  CudaMachine(const CudaMachine&) = delete;
  CudaMachine& operator=(const CudaMachine&) = delete;

  std::string name() const override { return name_; }
  std::size_t free_bytes() const override {
    std::size_t bytes = 0;
    check(module_.free_bytes(at_, &bytes));
    return bytes;
  }
  void* allocate(std::size_t bytes) override {
    void* device = nullptr;
    check(module_.allocate(at_, &device, bytes));
    return device;
  }
  // The error was already reported by the call in which it occurred.
  void release(void* device) override { static_cast<void>(module_.release(at_, device)); }
  void* allocate_host(std::size_t bytes) override {
    void* host = nullptr;
    check(module_.allocate_host(at_, &host, bytes));
    return host;
  }
  void release_host(void* host) override { static_cast<void>(module_.release_host(at_, host)); }
  void upload(int lane, void* to_device, const void* from, std::size_t bytes) override {
    check(module_.upload(at_, lane, to_device, from, bytes));
  }
  void download(int lane, void* to, const void* from_device, std::size_t bytes) override {
    check(module_.download(at_, lane, to, from_device, bytes));
  }
  void run(int lane, const Launch& launch) override { check(module_.run(at_, lane, &launch)); }
  std::string why_no_transforms() const override {
    std::array<char, 256> which{};
    return module_.transforms(which.data(), which.size()) != 0 ? "" : which.data();
  }
  void transform(int lane, double* values, int size, int rows, bool inverse) override {
    check(module_.transform(at_, lane, values, size, rows, inverse ? 1 : 0));
  }
  StepSeconds step_seconds(int lane) override {
    StepSeconds seconds;
    check(module_.step_seconds(at_, lane, &seconds));
    return seconds;
  }
  void order(int lane, int earlier) override { check(module_.order(at_, lane, earlier)); }
  void wait(int lane) override { check(module_.wait(at_, lane)); }

 private:
  /// After any error but full memory, the machine is not used again. DeviceEngine reports the error and may continue on the CPU.
  void check(int code) const {
    if (code == 0) return;
    const std::string why = name_ + ": " + module_.reason(code);
    if (module_.is_memory_full(code) != 0) throw DeviceMemoryFull(why);
    throw std::runtime_error(why);
  }
  const CudaModule& module_;
  std::string name_;
  void* at_ = nullptr;
};

}  // namespace

Result<std::unique_ptr<Machine>> open_cuda_machine() {
  const Found found = find_device();
  if (found.devices == 0) return failure(ErrorKind::unavailable, found.status);
  try {
    return std::make_unique<CudaMachine>(*found.module, found.status);
  } catch (const std::runtime_error& e) {
    return failure(ErrorKind::unavailable, e.what());
  }
}

}  // namespace sonar::cuda

namespace sonar {

std::string cuda_status() { return cuda::find_device().status; }

std::string cuda_presence() {
  const auto places = cuda::module_places();
  const auto exists = [](const std::filesystem::path& place) {
    std::error_code error;
    return std::filesystem::exists(place, error);
  };
  return std::any_of(places.begin(), places.end(), exists) ? "not used" : "not installed";
}

}  // namespace sonar
