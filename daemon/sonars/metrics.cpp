#include "daemon/sonars/metrics.hpp"

#include <dirent.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>

namespace sonar {

void Histogram::add(double seconds) {
  seconds = std::max(seconds, 0.0);
  const auto bound = std::lower_bound(bounds_s.begin(), bounds_s.end(), seconds);
  ++counts_[static_cast<std::size_t>(bound - bounds_s.begin())];
  ++count_;
  sum_s_ += seconds;
}

double Histogram::quantile_s(double q) const {
  if (count_ == 0) return 0;
  const double rank = std::clamp(q, 0.0, 1.0) * static_cast<double>(count_);
  double below = 0, lower_s = 0;
  for (std::size_t i = 0; i < bounds_s.size(); ++i) {
    const auto here = static_cast<double>(counts_[i]);
    if (here > 0 && below + here >= rank) return lower_s + (bounds_s[i] - lower_s) * std::max(rank - below, 0.0) / here;
    below += here;
    lower_s = bounds_s[i];
  }
  return bounds_s.back();
}

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
  f.open_descriptors = descriptors > 0 ? descriptors - 1 : 0;  // without the one that looked
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
