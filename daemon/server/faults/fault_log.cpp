#include "daemon/server/faults/fault_log.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "core/base/regular_file.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/control/control.hpp"

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

FaultLog::FaultLog(Events& events, Recordings& recordings, WriterThread& writer, Log& log)
    : events_(events), recordings_(recordings), writer_(writer), log_(log) {}
FaultLog::~FaultLog() = default;

Result<void> FaultLog::open(const std::filesystem::path& file) {
  auto opened = JournalFile::open(file);
  if (!opened) return tl::make_unexpected(opened.error());
  file_ = *std::move(opened);
  path_ = file;
  return {};
}

void FaultLog::append(const std::string& json) {
  if (pending_.size() + json.size() > most_waiting_bytes) return lose(1, "its file is written too slowly");
  pending_.append(json).append("\n");
  ++pending_entries_;
  if (!writing_) write_pending();
}

/// Writes one batch at a time; entries that arrive meanwhile are the next batch.
void FaultLog::write_pending() {
  writing_ = true;
  const std::uint64_t entries = std::exchange(pending_entries_, 0);
  const auto written = std::make_shared<JournalFile::Written>();
  writer_.run(
      [file = file_, lines = std::exchange(pending_, {}), written]() -> Result<void> {
        *written = file->append(lines);
        return {};
      },
      [this, entries, written](const Result<void>& done) {
        writing_ = false;
        if (written->lines < entries) {
          lose(entries - written->lines, done ? written->why : done.error().text);
        } else if (std::exchange(losing_, false)) {
          log_limited(log_, limiter_, LogLevel::info, "the fault journal can be written again", about_file());
        }
        if (!pending_.empty()) write_pending();
      });
}

/// Logs one line when losses begin and one line when they end, independent of the number of lost entries.
void FaultLog::lose(std::uint64_t entries, const std::string& why) {
  lost_ += entries;
  why_lost_ = why;
  if (!std::exchange(losing_, true))
    log_limited(log_, limiter_, LogLevel::error, "entries of the journal of faults are lost: " + why, about_file());
}

std::vector<LogField> FaultLog::about_file() const { return {{"file", path_.string()}, {"lost", lost_}}; }

std::vector<Note> FaultLog::notes() const {
  if (lost_ == 0) return {};
  return {{"", std::to_string(lost_) + " entries of the journal of faults " + path_.string() + " are lost: " + why_lost_,
           "free its disk or end what delays it; the latest " + std::to_string(most_remembered) +
               " entries: sonarctl fault journal --json"}};
}

/// Passes an entry to counters, file, recordings, events, and the list of latest entries.
void FaultLog::write(const FaultEntry& entry) {
  using std::chrono::steady_clock, std::chrono::system_clock;
  auto message = std::make_shared<v1::FaultEntry>();
  message->set_seq(++written_);
  message->set_utc_ns(system_clock::now().time_since_epoch().count());
  message->set_mono_ns(steady_clock::now().time_since_epoch().count());
  message->set_time_ns(entry.at.time_since_epoch().count());
  message->set_event(std::string(fault_entry_names[static_cast<std::size_t>(entry.what)]));
  message->set_fault(entry.fault);
  message->set_do_(entry.asked);
  message->set_kind(std::string(entry.kind->code));
  message->set_sonar(entry.sonar);
  message->set_client(entry.client);
  message->set_client_number(entry.client_number);
  message->set_ping(entry.ping);
  message->set_offset(entry.offset);
  message->set_bytes_before(entry.bytes_before);
  message->set_bytes_after(entry.bytes_after);
  for (const auto& [name, value] : entry.with) (*message->mutable_with())[name] = value;

  if (entry.what == FaultEntry::What::injected) ++injections_[entry.kind->code];
  if (const bool recorded = recordings_.takes(entry.sonar); file_ || recorded) {
    const std::string json = control::json_of(*message);
    if (file_) append(json);
    if (recorded) recordings_.take_fault(entry.sonar, entry.at, json);
  }
  if (events_.has_listeners()) {
    v1::Event event;
    *event.mutable_fault() = *message;
    events_.publish(event);
  }
  entries_.push_back(std::move(message));
  if (entries_.size() > most_remembered) entries_.pop_front();
}

}  // namespace sonar
