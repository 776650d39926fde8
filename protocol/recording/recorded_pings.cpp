#include "protocol/recording/recorded_pings.hpp"

#include <utility>
#include <variant>

namespace sonar::recording {

std::vector<RecordedPing> decode_next(protocol::Host& host, const protocol::Make& make, const RecordedMessage* message) {
  std::vector<RecordedPing> pings;
  const auto take = [&](protocol::HostActions actions, Time at) {
    for (protocol::HostAction& action : actions)
      if (auto* const ping = std::get_if<protocol::HostPing>(&action)) pings.push_back({at, std::move(*ping)});
  };
  if (const auto tick = host.next_tick(); tick && (message == nullptr || *tick <= message->at)) {
    const Time at = message == nullptr ? *tick : message->at;
    take(host.on_tick(at), at);
  }
  if (message == nullptr || message->from != Origin::device) return pings;
  if (const auto port = host_port(make, message->by)) take(host.on_bytes(*port, message->bytes, message->at), message->at);
  return pings;
}

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
  while (decoded_.empty()) {
    const auto message = reader_->next();
    for (RecordedPing& ping : decode_next(*host_, *by_.make, message ? &*message : nullptr)) decoded_.push_back(std::move(ping));
    if (!message && decoded_.empty()) return std::nullopt;
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
