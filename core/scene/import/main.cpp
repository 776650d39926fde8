// sonard-import-mesh reads one mesh file for sonard and its tools. If a bad file makes a mesh library crash, only this program
// ends, not sonard.
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cstring>

#include "core/base/memory_left.hpp"
#include "core/base/program_start.hpp"
#include "core/base/regular_file.hpp"
#include "core/scene/import/import_limits.hpp"
#include "core/scene/import/import_mesh.hpp"

#ifdef SONAR_SANITIZED
extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() { return "hard_rss_limit_mb=2048:max_allocation_size_mb=1024"; }
extern "C" const char* __tsan_default_options();
extern "C" const char* __tsan_default_options() { return "hard_rss_limit_mb=4096"; }
#endif

namespace {

std::string standard_input() {
  std::string text;
  char part[4096];
  for (ssize_t n = 0; (n = ::pread(STDIN_FILENO, part, sizeof part, static_cast<off_t>(text.size()))) > 0;)
    text.append(part, static_cast<std::size_t>(n));
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace sonar;
  auto request = request_from({argv + std::min(argc, 1), argv + argc});
  if (!request) {
    constexpr std::string_view text = "sonard-import-mesh is started by a sonard or sonarctl of the same version, not by hand\n";
    return ::write(STDERR_FILENO, text.data(), text.size()) < 0 ? 74 : 64;
  }
  static_cast<void>(make_room_for_stacks());  // the parent has the same limits and has reported a small one
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);         // ends this process when its parent ends
  if (::getppid() != request->parent) return 0;
  begin_import_limits(*request, STDOUT_FILENO);
  if (!request->readable.empty()) confine_reads(request->readable);
  memory_root() = request->memory_root;
  std::string held;
  if (!request->on_disk) request->mesh.in_memory = held = standard_input();
  std::error_code error;
  limit_import(request->on_disk ? std::filesystem::file_size(request->mesh.file, error) : held.size());
  const Result<LoadedMesh> mesh = import_mesh(request->mesh, {.opened = limit_import, .imported = release_import_memory});
  ::_exit(write_answer(STDOUT_FILENO, mesh) ? 0 : 74);
}
