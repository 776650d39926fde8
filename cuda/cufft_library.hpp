// Loads cuFFT by name. If it is missing, the module still loads, and the CPU computes exact pulses. Only cuda_module.cu uses
// it.
#pragma once

#include <cuda_runtime.h>

#include <cstddef>
#include <cstdio>
#include <type_traits>

#if __has_include(<cufft.h>)
#include <cufft.h>
#include <dlfcn.h>
#endif

namespace sonar::cuda {

inline constexpr int cufft_codes = 100000;  // codes of cuFFT begin here

#if __has_include(<cufft.h>)

#define SONAR_TEXT_OF(x) #x
#define SONAR_CUFFT_NAME(major) "libcufft.so." SONAR_TEXT_OF(major)  // the major number expands before it becomes text

class CufftLibrary {
 public:
  using Handle = cufftHandle;

  CufftLibrary() {
    // Searches for the version of the header that is used here: first where the loader searches, then beside the toolkit's
    // compiler.
    void* library = dlopen(SONAR_CUFFT_NAME(CUFFT_VER_MAJOR), RTLD_NOW | RTLD_LOCAL);
    if (!library) return;
    bool all = true;
    const auto look_up = [&](auto& function, const char* name) {
      function = reinterpret_cast<std::decay_t<decltype(function)>>(dlsym(library, name));
      all = all && function != nullptr;
    };
    look_up(plan_many_, "cufftPlanMany");
    look_up(set_stream_, "cufftSetStream");
    look_up(exec_, "cufftExecZ2Z");
    look_up(destroy_, "cufftDestroy");
    look_up(version_, "cufftGetVersion");
    loaded_ = all;
  }
  bool loaded() const { return loaded_; }
  /// "cuFFT 12.0.0", or the name of the missing file.
  void describe(char* text, std::size_t room) const {
    int version = 0;
    if (loaded_ && version_(&version) == CUFFT_SUCCESS)
      std::snprintf(text, room, "cuFFT %d.%d.%d", version / 1000, version / 100 % 10, version % 100);
    else
      std::snprintf(text, room, "no %s", SONAR_CUFFT_NAME(CUFFT_VER_MAJOR));
  }
  /// Plans transforms on `stream`: `rows` transforms of `size` values each, row after row.
  int make(Handle* plan, int size, int rows, cudaStream_t stream) const {
    // Without embedding, rows follow each other without gaps.
    const cufftResult made = plan_many_(plan, 1, &size, nullptr, 1, size, nullptr, 1, size, CUFFT_Z2Z, rows);
    if (made != CUFFT_SUCCESS) return cufft_codes + made;
    const cufftResult set = set_stream_(*plan, stream);
    if (set == CUFFT_SUCCESS) return 0;
    destroy_(*plan);
    return cufft_codes + set;
  }
  int run(Handle plan, void* values, bool inverse) const {
    auto* complex = static_cast<cufftDoubleComplex*>(values);
    const cufftResult done = exec_(plan, complex, complex, inverse ? CUFFT_INVERSE : CUFFT_FORWARD);
    return done == CUFFT_SUCCESS ? 0 : cufft_codes + done;
  }
  void destroy(Handle plan) const { destroy_(plan); }
  static bool is_memory_full(int code) { return code - cufft_codes == CUFFT_ALLOC_FAILED; }
  static const char* reason(int code) {
    switch (code - cufft_codes) {
      case CUFFT_ALLOC_FAILED:
        return "cuFFT: out of memory";
      case CUFFT_SETUP_FAILED:
        return "cuFFT could not start";
      case CUFFT_EXEC_FAILED:
        return "cuFFT: a transform failed";
      case CUFFT_INVALID_SIZE:
        return "cuFFT: unsupported transform size";
      default:
        return "cuFFT failed";
    }
  }

 private:
  bool loaded_ = false;
  decltype(&cufftPlanMany) plan_many_ = nullptr;
  decltype(&cufftSetStream) set_stream_ = nullptr;
  decltype(&cufftExecZ2Z) exec_ = nullptr;
  decltype(&cufftDestroy) destroy_ = nullptr;
  decltype(&cufftGetVersion) version_ = nullptr;
};

#undef SONAR_CUFFT_NAME
#undef SONAR_TEXT_OF

#else

class CufftLibrary {
 public:
  using Handle = int;
  bool loaded() const { return false; }
  void describe(char* text, std::size_t room) const { std::snprintf(text, room, "built without cuFFT"); }
  int make(Handle*, int, int, cudaStream_t) const { return cufft_codes; }
  int run(Handle, void*, bool) const { return cufft_codes; }
  void destroy(Handle) const {}
  static bool is_memory_full(int) { return false; }
  static const char* reason(int) { return "built without cuFFT"; }
};

#endif

/// Returns the library. The first call loads it; it stays loaded.
inline const CufftLibrary& cufft() {
  static const CufftLibrary library;
  return library;
}

}  // namespace sonar::cuda
