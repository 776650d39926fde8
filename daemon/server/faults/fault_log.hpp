// The journal of faults: what each did, as JSON lines in a file, in recordings, as events, as counters, and the last entries in
// memory. Owned by App; I/O thread only.
#pragma once

#include <cstdint>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "core/base/result.hpp"
#include "daemon/emulator/faults/journal.hpp"
#include "daemon/server/events.hpp"
#include "daemon/server/recording/recordings.hpp"

namespace sonar {

namespace v1 {
class FaultEntry;
}

class FaultLog final : public FaultJournal {
 public:
  static constexpr std::size_t most_remembered = 1000;

  FaultLog(Events& events, Recordings& recordings);
  ~FaultLog() override;
  FaultLog(const FaultLog&) = delete;
  FaultLog& operator=(const FaultLog&) = delete;

  /// Appends to `file` from now on. io, with the reason.
  Result<void> open(const std::filesystem::path& file);
  void write(const FaultEntry& entry) override;

  /// The latest, oldest first; each has a number counted from 1.
  const std::deque<std::shared_ptr<const v1::FaultEntry>>& entries() const { return entries_; }
  /// Injections since the start, by code.
  const std::map<std::string_view, std::uint64_t>& injections() const { return injections_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  Events& events_;
  Recordings& recordings_;
  std::unique_ptr<std::FILE, Close> file_;
  std::deque<std::shared_ptr<const v1::FaultEntry>> entries_;
  std::map<std::string_view, std::uint64_t> injections_;
  std::uint64_t written_ = 0;
};

}  // namespace sonar
