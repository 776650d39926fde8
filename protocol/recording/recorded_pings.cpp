#include "protocol/recording/recorded_pings.hpp"

#include <utility>
#include <variant>

namespace sonar::recording {

Result<RecordedPings> RecordedPings::open(std::unique_ptr<RecordingReader> reader) {
  auto by = find_sender(*reader);
  if (!by) return failure(ErrorKind::bad_data, "holds no ping of a known sonar");
  RecordedPings pings(std::move(reader), std::move(*by));
  if (const Result<void> made = pings.make_host(); !made) return tl::unexpected(made.error());
  return pings;
}

/// The host decodes messages of a recording as it decodes those of a sonar. Nothing is sent (as_it_is). With a new host the
/// sequence and the pictures of a scan begin anew.
Result<void> RecordedPings::make_host() {
  protocol::Wanted wanted;
  wanted.as_it_is = true;
  auto host = by_.make->host(wanted);
  if (!host) return tl::unexpected(host.error());
  host_ = *std::move(host);
  return {};
}

std::optional<RecordedPing> RecordedPings::next() {
  const auto take = [&](protocol::HostActions actions, Time at) {
    for (protocol::HostAction& action : actions)
      if (auto* const ping = std::get_if<protocol::HostPing>(&action)) decoded_.push_back({at, std::move(*ping)});
  };
  while (decoded_.empty()) {
    const auto message = reader_->next();
    if (!message) {  // a ping may still wait for a message that the recording does not have
      if (const auto tick = host_->next_tick()) take(host_->on_tick(*tick), *tick);
      if (decoded_.empty()) return std::nullopt;
      break;
    }
    if (const auto tick = host_->next_tick(); tick && *tick <= message->at) take(host_->on_tick(message->at), message->at);
    const auto port = host_port(*by_.make, message->by);
    if (port && message->from == Origin::device) take(host_->on_bytes(*port, message->bytes, message->at), message->at);
  }
  RecordedPing first = std::move(decoded_.front());
  decoded_.pop_front();
  return first;
}

void RecordedPings::rewind() {
  reader_->rewind();
  decoded_.clear();
  static_cast<void>(make_host());  // succeeds, as it did in open()
}

}  // namespace sonar::recording
