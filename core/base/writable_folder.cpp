#include "core/base/writable_folder.hpp"

#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>

namespace sonar {
namespace {

/// File systems whose files the kernel makes or interprets. Even root cannot create ordinary files in them.
// The numbers are from the kernel's sources.
constexpr unsigned long mqueue_magic = 0x19800202, configfs_magic = 0x62656570, fusectl_magic = 0x65735543;
constexpr std::array<unsigned long, 19> kernels_own{PROC_SUPER_MAGIC, SYSFS_MAGIC,    CGROUP_SUPER_MAGIC, CGROUP2_SUPER_MAGIC,
                                                    DEBUGFS_MAGIC,    TRACEFS_MAGIC,  SECURITYFS_MAGIC,   DEVPTS_SUPER_MAGIC,
                                                    BPF_FS_MAGIC,     PSTOREFS_MAGIC, HUGETLBFS_MAGIC,    BINFMTFS_MAGIC,
                                                    EFIVARFS_MAGIC,   SELINUX_MAGIC,  SMACK_MAGIC,        RDTGROUP_SUPER_MAGIC,
                                                    mqueue_magic,     configfs_magic, fusectl_magic};

std::optional<dev_t> file_system_of(const char* file) {
  struct stat status {};
  return ::stat(file, &status) == 0 ? std::optional(status.st_dev) : std::nullopt;
}

/// True for /dev and its folders, except for folders with their own file system, such as /dev/shm.
bool is_of_devices(const std::filesystem::path& folder) {
  const auto devices = file_system_of("/dev");
  return devices && devices != file_system_of("/") && devices == file_system_of(folder.c_str());
}

}  // namespace

std::string why_no_files_in(const std::filesystem::path& folder) {
  std::error_code ec;
  if (!std::filesystem::is_directory(folder, ec)) return "is not a folder";
  struct statfs about {};
  if (::statfs(folder.c_str(), &about) == 0 &&
      std::find(kernels_own.begin(), kernels_own.end(), static_cast<unsigned long>(about.f_type)) != kernels_own.end())
    return "contains only the kernel's own files; other files cannot be written there";
  if (is_of_devices(folder)) return "is for devices; files there take memory and are lost when the computer stops";
  if (::access(folder.c_str(), W_OK | X_OK) == 0) return {};
  return std::string("cannot be written: ") + std::strerror(errno);
}

}  // namespace sonar
