#include "core/base/writable_folder.hpp"

#include <linux/magic.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace sonar {
namespace {

/// File systems whose files the kernel makes. Even the superuser cannot make a file there.
constexpr std::array<unsigned long, 10> kernels_own{PROC_SUPER_MAGIC, SYSFS_MAGIC,   CGROUP_SUPER_MAGIC, CGROUP2_SUPER_MAGIC,
                                                    DEBUGFS_MAGIC,    TRACEFS_MAGIC, SECURITYFS_MAGIC,   DEVPTS_SUPER_MAGIC,
                                                    BPF_FS_MAGIC,     PSTOREFS_MAGIC};

}  // namespace

std::string why_no_files_in(const std::filesystem::path& folder) {
  std::error_code ec;
  if (!std::filesystem::is_directory(folder, ec)) return "is not a folder";
  struct statfs about {};
  if (::statfs(folder.c_str(), &about) == 0 &&
      std::find(kernels_own.begin(), kernels_own.end(), static_cast<unsigned long>(about.f_type)) != kernels_own.end())
    return "holds the kernel's own files; no others can be written there";
  if (::access(folder.c_str(), W_OK | X_OK) == 0) return {};
  return std::string("cannot be written: ") + std::strerror(errno);
}

}  // namespace sonar
