#include "daemon/server/system/process_figures.hpp"

#include <dirent.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>

namespace sonar {
namespace {

std::uint64_t entries_of(const char* folder) {
  DIR* const directory = opendir(folder);
  if (directory == nullptr) return 0;
  std::uint64_t count = 0;
  while (const dirent* entry = readdir(directory))
    if (entry->d_name[0] != '.') ++count;
  closedir(directory);
  return count;
}

}  // namespace

ProcessFigures figures_of_this_process() {
  ProcessFigures f;
  const auto page_bytes = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  std::ifstream statm("/proc/self/statm");
  std::uint64_t pages = 0, resident_pages = 0;
  if (statm >> pages >> resident_pages) f.resident_bytes = resident_pages * page_bytes;
  statm.close();
  const std::uint64_t descriptors = entries_of("/proc/self/fd");
  f.open_descriptors = descriptors > 0 ? descriptors - 1 : 0;  // without the descriptor used for counting
  f.threads = entries_of("/proc/self/task");
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) f.descriptor_limit = limit.rlim_cur;
  rusage used{};
  if (getrusage(RUSAGE_SELF, &used) == 0)
    f.processor_s = static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
                    1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
  return f;
}

}  // namespace sonar
