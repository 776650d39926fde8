// The journal of faults. Each effect of a fault is one entry: a JSON line in a file and in recordings, an event, and a count.
// The last entries are kept in memory. App owns the journal, and only the I/O thread calls it. The writer thread writes the
// file; entries that it cannot write are counted.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "daemon/emulator/faults/journal.hpp"
#include "daemon/emulator/world/plausibility.hpp"
#include "daemon/server/api/events.hpp"
#include "daemon/server/recording/recordings.hpp"
#include "daemon/server/recording/writer_thread.hpp"
#include "daemon/server/system/log.hpp"

namespace sonar {

// The file of the journal of faults. Lines are appended completely or not at all. Opening and writing never wait for the reader
// of a FIFO.

class JournalFile {
 public:
  /// Opens or creates the file. A FIFO must have a reader. Errors: io.
  static Result<std::shared_ptr<JournalFile>> open(const std::filesystem::path& file);
  /// Returns the error that open() would return, without creating the file.
  static Result<void> check(const std::filesystem::path& file);
  ~JournalFile();
  JournalFile(const JournalFile&) = delete;
  JournalFile& operator=(const JournalFile&) = delete;

  struct Written {
    std::uint64_t lines = 0;
    std::string why;  // why entries are missing; empty = none is missing
  };
  /// Appends lines. Stops at the first line that fails; a later call tries again.
  Written append(std::string_view lines);

 private:
  explicit JournalFile(int descriptor) : descriptor_(descriptor) {}
  std::string write_line(std::string_view line);

  int descriptor_;
  bool cut_ = false;  // true: the file ends with an incomplete line
};

namespace v1 {
class FaultEntry;
}

class FaultLog final : public FaultJournal {
 public:
  static constexpr std::size_t most_remembered = 1000;

  static constexpr std::size_t most_waiting_bytes = 1u << 20;  // limit for entries that are not in the file yet

  FaultLog(Events& events, Recordings& recordings, WriterThread& writer, Log& log);
  ~FaultLog() override;
  FaultLog(const FaultLog&) = delete;
  FaultLog& operator=(const FaultLog&) = delete;

  /// Appends to `file` from now on. Errors: io, with the reason.
  Result<void> open(const std::filesystem::path& file);
  void write(const FaultEntry& entry) override;

  /// Returns the latest entries, oldest first. Their numbers begin with 1.
  const std::deque<std::shared_ptr<const v1::FaultEntry>>& entries() const { return entries_; }
  /// Returns the number of injections since the start, by code.
  const std::map<std::string_view, std::uint64_t>& injections() const { return injections_; }
  /// Returns the number of entries that could not be written to the file.
  std::uint64_t lost() const { return lost_; }
  /// Returns a note for the status if entries were lost, with the reason.
  std::vector<Note> notes() const;

 private:
  void append(const std::string& json);
  void write_pending();
  void lose(std::uint64_t entries, const std::string& why);
  std::vector<LogField> about_file() const;

  Events& events_;
  Recordings& recordings_;
  WriterThread& writer_;
  Log& log_;
  std::filesystem::path path_;
  std::shared_ptr<JournalFile> file_;  // used by the writer thread while it writes
  std::string pending_;                // JSON lines that the writer thread has not got yet
  std::uint64_t pending_entries_ = 0, lost_ = 0;
  std::string why_lost_;
  bool writing_ = false, losing_ = false;
  LogLimiter limiter_;
  std::deque<std::shared_ptr<const v1::FaultEntry>> entries_;
  std::map<std::string_view, std::uint64_t> injections_;
  std::uint64_t written_ = 0;
};

}  // namespace sonar
