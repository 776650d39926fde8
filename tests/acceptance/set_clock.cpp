// A library for LD_PRELOAD. It shifts the computer's clock for one program by the seconds in the file that SET_CLOCK names, an
// int64.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <ctime>

namespace {

const volatile std::int64_t* shift() {
  const char* const file = std::getenv("SET_CLOCK");
  const int descriptor = file == nullptr ? -1 : ::open(file, O_RDONLY | O_CLOEXEC);
  void* const mapped = ::mmap(nullptr, sizeof(std::int64_t), PROT_READ, MAP_SHARED, descriptor, 0);
  if (mapped == MAP_FAILED) std::abort();
  ::close(descriptor);
  return static_cast<const volatile std::int64_t*>(mapped);
}

}  // namespace

extern "C" int clock_gettime(clockid_t which, timespec* now) noexcept {
  static const auto real = reinterpret_cast<int (*)(clockid_t, timespec*)>(::dlsym(RTLD_NEXT, "clock_gettime"));
  static const volatile std::int64_t* const by_s = shift();
  const int done = real(which, now);
  if (which == CLOCK_REALTIME) now->tv_sec += *by_s;
  return done;
}
