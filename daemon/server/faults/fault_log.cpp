#include "daemon/server/faults/fault_log.hpp"

#include <cerrno>
#include <chrono>
#include <cstring>

#include "protocol/control/answers.hpp"

namespace sonar {

FaultLog::FaultLog(Events& events, Recordings& recordings) : events_(events), recordings_(recordings) {}
FaultLog::~FaultLog() = default;

Result<void> FaultLog::open(const std::filesystem::path& file) {
  file_.reset(std::fopen(file.c_str(), "ae"));
  if (!file_)
    return failure(ErrorKind::io, "the journal of faults cannot be written: " + file.string() + ": " + std::strerror(errno) +
                                      "; faults.journal or --fault-journal names another file");
  std::setvbuf(file_.get(), nullptr, _IOLBF, 4096);
  return {};
}

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
    if (file_) std::fputs((json + "\n").c_str(), file_.get());
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
