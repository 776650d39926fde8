#include "daemon/server/faults/journal_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace sonar {
namespace {

Result<int> open_for_appending(const std::filesystem::path& file, int more_flags) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC | O_NONBLOCK | O_NOCTTY | more_flags, 0666);
  if (descriptor >= 0) return descriptor;
  const int error = errno;
  std::error_code ec;
  const bool is_unread = error == ENXIO && std::filesystem::is_fifo(file, ec);
  const std::string why = is_unread ? "no program reads this FIFO: start its reader first" : std::strerror(error);
  return failure(ErrorKind::io, "the journal of faults cannot be written: " + file.string() + ": " + why +
                                    "; faults.journal or --fault-journal names another file");
}

}  // namespace

Result<std::shared_ptr<JournalFile>> JournalFile::open(const std::filesystem::path& file) {
  const auto descriptor = open_for_appending(file, O_CREAT);
  if (!descriptor) return tl::make_unexpected(descriptor.error());
  return std::shared_ptr<JournalFile>(new JournalFile(*descriptor));
}

/// Opens without O_CREAT. If the file is missing, it checks whether it could be created.
Result<void> JournalFile::check(const std::filesystem::path& file) {
  const auto descriptor = open_for_appending(file, 0);
  if (descriptor) {
    ::close(*descriptor);
    return {};
  }
  std::error_code ec;
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  const bool can_be_made = std::filesystem::symlink_status(file, ec).type() == std::filesystem::file_type::not_found &&
                           ::access(folder.c_str(), W_OK | X_OK) == 0;
  return can_be_made ? Result<void>{} : tl::make_unexpected(descriptor.error());
}

JournalFile::~JournalFile() { ::close(descriptor_); }

/// The caller learns how many lines are in the file, and counts the rest as lost.
JournalFile::Written JournalFile::append(std::string_view lines) {
  Written written;
  while (!lines.empty()) {
    const std::string_view line = lines.substr(0, std::min(lines.find('\n'), lines.size() - 1) + 1);
    written.why = write_line(line);
    if (!written.why.empty()) break;
    ++written.lines;
    lines.remove_prefix(line.size());
  }
  return written;
}

/// Writes a line. Returns why it could not; empty if it is written.
std::string JournalFile::write_line(std::string_view line) {
  const std::string text = (std::exchange(cut_, false) ? "\n" : "") + std::string(line);
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t n = ::write(descriptor_, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) break;
    done += static_cast<std::size_t>(n);
  }
  if (done == text.size()) return {};
  const std::string why = errno == EAGAIN ? "its reader is too slow" : std::strerror(errno);
  struct stat status {};
  const auto part = static_cast<off_t>(done);
  // A part of a line is removed from a regular file; from a FIFO it cannot be. Then the next line begins with a newline.
  const bool taken_back = done == 0 || (::fstat(descriptor_, &status) == 0 && S_ISREG(status.st_mode) && status.st_size >= part &&
                                        ::ftruncate(descriptor_, status.st_size - part) == 0);
  cut_ = !taken_back;
  return why;
}

}  // namespace sonar
