#include "daemon/server/faults/fault_log.hpp"

#include <chrono>
#include <utility>

#include "protocol/control/answers.hpp"
#include "protocol/control/control.hpp"

namespace sonar {

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
