#include "core/base/memory_left.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

namespace sonar {
namespace {

using std::filesystem::path;

/// Returns the number at the start of a file; nullopt if there is none, as with the word "max".
std::optional<std::uint64_t> number_in(const path& file) {
  std::ifstream in(file);
  std::uint64_t number = 0;
  return in >> number ? std::optional(number) : std::nullopt;
}

/// Returns the number that follows a word at the beginning of a line; 0 if no line begins with the word.
std::uint64_t number_after(const path& file, const std::string& word) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with(word)) continue;
    const auto digits = line.find_first_of("0123456789", word.size());
    if (digits != std::string::npos) return std::strtoull(line.c_str() + digits, nullptr, 10);
  }
  return 0;
}

struct Names {  // files of one version of control groups
  const char *limit, *used, *cache;
};
constexpr Names version_1{"memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file "};
constexpr Names version_2{"memory.max", "memory.current", "inactive_file "};

/// Returns the minimum of the memory left to a control group and to its parents, as far as this process can read them.
std::optional<std::uint64_t> left_of_groups(const path& mount, path group, const Names& names) {
  std::optional<std::uint64_t> least;
  for (group = group.relative_path();; group = group.parent_path()) {
    const path here = mount / group;
    const auto limit = number_in(here / names.limit), used = number_in(here / names.used);
    if (limit && used) {
      const std::uint64_t cache = std::min(number_after(here / "memory.stat", names.cache), *used);
      const std::uint64_t left = *limit - std::min(*limit, *used - cache);
      least = std::min(least.value_or(left), left);
    }
    if (group.empty()) return least;
  }
}

}  // namespace

path& memory_root() {
  static path root = "/";
  return root;
}

std::optional<std::uint64_t> memory_left_bytes() {
  const path& root = memory_root();
  std::optional<std::uint64_t> least;
  const auto take = [&least](std::optional<std::uint64_t> left) {
    if (left) least = std::min(least.value_or(*left), *left);
  };
  const path meminfo = root / "proc/meminfo";
  if (const std::uint64_t available_kib = number_after(meminfo, "MemAvailable:"); available_kib > 0)
    take((available_kib + number_after(meminfo, "SwapFree:")) * 1024);
  std::ifstream groups(root / "proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {  // "0::/a/b", "9:memory:/a/b"
    const auto first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const path group = line.substr(second + 1);
    if (controllers.empty()) take(left_of_groups(root / "sys/fs/cgroup", group, version_2));
    if (controllers == "memory") take(left_of_groups(root / "sys/fs/cgroup/memory", group, version_1));
  }
  return least;
}

void offer_for_out_of_memory() { std::ofstream("/proc/self/oom_score_adj") << 1000; }

std::optional<std::uint64_t> address_space_bytes() {
  const auto pages = number_in("/proc/self/statm");
  return pages ? std::optional(*pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE))) : std::nullopt;
}

Result<void> check_memory_for(const std::string& what, std::uint64_t bytes) {
  const auto left = memory_left_bytes();
  if (!left || bytes <= *left - *left / 10) return {};
  const auto mib = [](std::uint64_t n) { return std::to_string(n >> 20) + " MiB"; };
  return failure(ErrorKind::unavailable,
                 what + " would take about " + mib(bytes) + " of memory, and " + mib(*left) +
                     " are left to this process; use a smaller scene, or give the process more (MemoryMax, "
                     "docker --memory)");
}

}  // namespace sonar
