#include "core/scene/import/import_limits.hpp"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <new>

#include "core/base/memory_left.hpp"

// The shadow memory of sanitizers uses terabytes of address space. Therefore the runtime of the sanitizers applies the limit
// instead (main.cpp).
#ifdef SONAR_SANITIZED
constexpr bool limits_addresses = false;
#else
constexpr bool limits_addresses = true;
#endif

namespace sonar {
namespace {

struct {
  int descriptor = -1;
  ErrorKind memory_kind = ErrorKind::bad_data;
  std::string name, memory, time;  // error texts, made in advance
  std::uint64_t at_start = 0;      // address space at the start in bytes
} limits;

[[noreturn]] void end_for_memory() {
  write_refusal(limits.descriptor, limits.memory_kind, limits.memory);
  ::_exit(0);
}
void end_for_time(int) {
  write_refusal(limits.descriptor, ErrorKind::bad_data, limits.time);
  ::_exit(0);
}

void limit(__rlimit_resource_t resource, rlim_t soft, rlim_t hard) {
  rlimit now{};
  if (::getrlimit(resource, &now) != 0) return;
  const rlimit wanted{std::min(soft, now.rlim_max), std::min(hard, now.rlim_max)};
  if (::setrlimit(resource, &wanted) != 0) return;  // the other limits still apply
}

}  // namespace

void begin_import_limits(const ImportRequest& request, int descriptor) {
  limits.descriptor = descriptor;
  limits.name = request.mesh.file.filename().string();
  limits.at_start = address_space_bytes().value_or(std::uint64_t{256} << 20);
  offer_for_out_of_memory();
  limit(RLIMIT_FSIZE, RLIM_INFINITY, RLIM_INFINITY);  // no limit, because this program writes to memory only
  ::prctl(PR_SET_DUMPABLE, 0);                        // no core dump, because the file caused the error
  std::set_new_handler(end_for_memory);
  struct sigaction action {};
  action.sa_handler = end_for_time;
  ::sigaction(SIGXCPU, &action, nullptr);
  ::sigaction(SIGALRM, &action, nullptr);
}

void limit_import(std::uintmax_t bytes) {
  std::uint64_t memory = import_memory_bytes + import_memory_of_a_byte * bytes;
  limits.memory_kind = ErrorKind::bad_data;
  limits.memory = limits.name + ": takes more than " + std::to_string(memory >> 20) +
                  " MiB of memory to read, far more than a file of its size should; it is damaged, or repeats its parts too "
                  "often: export it again";
  if (const auto left = memory_left_bytes(); left && *left - *left / 10 < memory) {
    memory = std::max(*left - *left / 10, std::uint64_t{32} << 20);
    limits.memory_kind = ErrorKind::unavailable;
    limits.memory =
        limits.name + ": takes more than the " + std::to_string(memory >> 20) +
        " MiB of memory that are left to read it; use a smaller mesh, or give sonard more (MemoryMax, docker --memory)";
  }
  rlimit space{};
  if (::getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_max != RLIM_INFINITY && space.rlim_max < limits.at_start + memory) {
    limits.memory_kind = ErrorKind::unavailable;
    limits.memory = limits.name + ": takes more memory to read than the limit of addresses leaves, " +
                    std::to_string(space.rlim_max >> 20) + " MiB in all; raise it (ulimit -v, LimitAS=)";
  }
  const std::uint64_t seconds = import_seconds + import_seconds_of_a_million * bytes / 1'000'000;
  limits.time =
      limits.name + ": is not read within " + std::to_string(seconds) + " s of processor time; simplify it, or join its objects";
  if (limits_addresses) limit(RLIMIT_AS, limits.at_start + memory, RLIM_INFINITY);
  limit(RLIMIT_CPU, seconds, RLIM_INFINITY);
  ::alarm(static_cast<unsigned>(20 * seconds));
}

void release_import_memory() {
  limits.memory_kind = ErrorKind::unavailable;
  limits.memory = limits.name + ": needs more memory than there is; use a smaller mesh";
  if (limits_addresses) limit(RLIMIT_AS, RLIM_INFINITY, RLIM_INFINITY);
}

}  // namespace sonar
