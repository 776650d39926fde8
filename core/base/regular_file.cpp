#include "core/base/regular_file.hpp"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>

#include "core/base/memory_left.hpp"

namespace sonar {
namespace {

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "folder";
  if (S_ISFIFO(mode)) return "FIFO";
  if (S_ISSOCK(mode)) return "socket";
  return "device";
}

tl::unexpected<Error> not_opened(const std::filesystem::path& file) {
  const int error = errno;
  std::error_code ec;
  const std::string to = error == ENOENT ? std::filesystem::read_symlink(file, ec).string() : "";
  const std::string why = error == ELOOP    ? "its links lead round in a circle, or are too many; name the file itself"
                          : error == EACCES ? "Permission denied; give this user the right to read it and to enter its folders"
                          : to.empty()      ? std::strerror(error)
                                            : "it is a link to \"" + to + "\", which does not exist";
  return failure(ErrorKind::missing_file, file.string() + ": cannot be opened: " + why);
}

std::filesystem::path& folder_to_read() {  // empty: files of every folder may be read
  static std::filesystem::path folder;
  return folder;
}

bool is_readable(const std::filesystem::path& file) {
  const std::filesystem::path& folder = folder_to_read();
  if (folder.empty()) return true;
  std::error_code ec;
  const std::filesystem::path place = std::filesystem::canonical(file, ec);
  return ec || std::mismatch(folder.begin(), folder.end(), place.begin(), place.end()).first == folder.end();
}

}  // namespace

void confine_reads(const std::filesystem::path& folder) { folder_to_read() = std::filesystem::canonical(folder); }
const std::filesystem::path& readable_folder() { return folder_to_read(); }

bool is_absent(const std::filesystem::path& file) {
  struct stat status {};
  return ::lstat(file.c_str(), &status) != 0 && (errno == ENOENT || errno == ENOTDIR);
}

Result<OpenFile> open_regular(const std::filesystem::path& file) {
  if (!is_readable(file))
    return failure(ErrorKind::missing_file, file.string() + ": is outside of " + readable_folder().string() +
                                                ", the only folder whose files this program reads; put a copy there");
  struct stat status {};
  const auto is_other = [&] {
    return failure(ErrorKind::missing_file,
                   file.string() + ": is a " + kind_of(status.st_mode) + ", not a regular file; " +
                       (S_ISDIR(status.st_mode) ? "name a file in it" : "save its contents in a regular file"));
  };
  if (::stat(file.c_str(), &status) != 0) return not_opened(file);
  if (!S_ISREG(status.st_mode)) return is_other();  // opening a device may start an action
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (descriptor < 0) return not_opened(file);
  OpenFile opened(::fdopen(descriptor, "rb"));
  if (!opened) {
    ::close(descriptor);
    return not_opened(file);
  }
  // A FIFO may have replaced this file since the check. Because of O_NONBLOCK, open() did not wait for its writer. The flag has
  // no effect on regular files.
  if (::fstat(descriptor, &status) != 0) return not_opened(file);
  if (!S_ISREG(status.st_mode)) return is_other();
  return opened;
}

Result<std::string> read_regular(const std::filesystem::path& file, std::size_t most_bytes) {
  auto in = open_regular(file);
  if (!in) return tl::make_unexpected(in.error());
  std::string text;
  struct stat status {};
  if (::fstat(::fileno(in->get()), &status) == 0 && status.st_size > 0) {
    const std::size_t bytes = std::min(static_cast<std::size_t>(status.st_size), most_bytes) + 1;
    if (auto room = check_memory_for(file.string(), bytes); !room) return tl::make_unexpected(room.error());
    text.reserve(bytes);
  }
  std::array<char, std::size_t{1} << 16> part;
  while (text.size() <= most_bytes) {
    const std::size_t n = std::fread(part.data(), 1, std::min(part.size(), most_bytes + 1 - text.size()), in->get());
    if (n == 0) break;
    text.append(part.data(), n);
  }
  if (std::ferror(in->get()) != 0) return failure(ErrorKind::io, file.string() + ": cannot be read: " + std::strerror(errno));
  return text;
}

int open_to_write(const std::filesystem::path& file, int flags) {
  const int descriptor = ::open(file.c_str(), flags | O_WRONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, 0666);
  if (descriptor >= 0) ::fcntl(descriptor, F_SETFL, ::fcntl(descriptor, F_GETFL) & ~O_NONBLOCK);
  return descriptor;
}

std::string why_not_written(const std::filesystem::path& file, int error) {
  std::error_code ec;
  if (error == ENXIO && std::filesystem::is_fifo(file, ec)) return "it is a pipe that no program reads; start its reader first";
  const std::string why = std::strerror(error);
  if (error == ENOSPC || error == EDQUOT || error == EFBIG) return why + "; make room";
  if (error == EACCES || error == EPERM) return why + "; give this user the right to write there";
  if (error == EROFS) return why + "; choose a place that can be written";
  const std::filesystem::path folder = file.parent_path();
  if (error == ENOENT && !folder.empty() && !std::filesystem::exists(folder, ec)) return why + "; make its folder first";
  return why;
}

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
