#include "daemon/server/faults/journal_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "core/base/regular_file.hpp"

namespace sonar {
namespace {

Error refusal(const std::filesystem::path& file, const std::string& why) {
  return {ErrorKind::io, "the journal of faults cannot be written: " + file.string() + ": " + why +
                             "; faults.journal or --fault-journal names another file"};
}

bool is_missing(const std::filesystem::path& file) {
  std::error_code ec;
  return std::filesystem::status(file, ec).type() == std::filesystem::file_type::not_found;
}

/// Returns the reason if the file, existing or new, cannot be a journal; else an empty text.
std::string why_no_journal(const std::filesystem::path& file) {
  std::error_code ec;
  if (std::filesystem::is_block_file(file, ec)) return "is a disk, not a file";
  if (!is_missing(file)) return {};
  std::filesystem::path made = std::filesystem::absolute(file, ec);
  while (std::filesystem::is_symlink(made, ec)) made = made.parent_path() / std::filesystem::read_symlink(made, ec);
  const std::filesystem::path folder = made.parent_path();
  const std::string why = why_no_files_in(folder);
  return why.empty() ? why : folder.string() + " " + why;
}

Result<int> open_for_appending(const std::filesystem::path& file, int more_flags) {
  if (const std::string why = why_no_journal(file); !why.empty()) return tl::make_unexpected(refusal(file, why));
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC | O_NONBLOCK | O_NOCTTY | more_flags, 0666);
  if (descriptor >= 0) return descriptor;
  const int error = errno;
  std::error_code ec;
  const bool is_unread = error == ENXIO && std::filesystem::is_fifo(file, ec);
  return tl::make_unexpected(
      refusal(file, is_unread ? "no program reads this FIFO: start its reader first" : std::strerror(error)));
}

}  // namespace

Result<std::shared_ptr<JournalFile>> JournalFile::open(const std::filesystem::path& file) {
  const auto descriptor = open_for_appending(file, O_CREAT);
  if (!descriptor) return tl::make_unexpected(descriptor.error());
  return std::shared_ptr<JournalFile>(new JournalFile(*descriptor));
}

/// Like open(), but without creating a file.
Result<void> JournalFile::check(const std::filesystem::path& file) {
  const auto descriptor = open_for_appending(file, 0);
  if (descriptor) ::close(*descriptor);
  if (descriptor || (is_missing(file) && why_no_journal(file).empty())) return {};
  return tl::make_unexpected(descriptor.error());
}

JournalFile::~JournalFile() { ::close(descriptor_); }

/// Returns the number of written lines; the caller counts the other lines as lost.
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

/// Writes a line. Returns the reason of a failure, or an empty text.
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
  // An incomplete line is removed from a regular file. In a FIFO that is impossible, so the next line begins with a newline.
  const bool taken_back = done == 0 || (::fstat(descriptor_, &status) == 0 && S_ISREG(status.st_mode) && status.st_size >= part &&
                                        ::ftruncate(descriptor_, status.st_size - part) == 0);
  cut_ = !taken_back;
  return why;
}

}  // namespace sonar
