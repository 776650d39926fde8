#include "daemon/emulator/connections/connections.hpp"

#include <algorithm>

namespace sonar {
namespace {

using State = Connection::State;

}  // namespace

void add_traffic(DeviceFigures& f, const Connection& c) {
  f.offered += c.outbox.pings_offered();
  f.sent += c.outbox.pings_written();
  f.dropped += c.outbox.pings_dropped();
  for (std::size_t why = 0; why < drop_reasons; ++why) f.dropped_by[why] += c.outbox.dropped_by_reason()[why];
  f.waiting += c.outbox.pings_waiting();
  f.bytes_written += c.bytes_written;
  f.bytes_read += c.bytes_read;
}

bool Connection::receives(std::size_t stream) const {
  return std::any_of(receivers.begin(), receivers.end(),
                     [stream](const protocol::SetReceivers& list) { return list.stream == stream && !list.to.empty(); });
}

// `not_before` limits the rate of ticks, because a dialogue that is always due would keep the sonar busy.
std::optional<Time> Connection::next_tick() const {
  if (finishing || dialogue == nullptr) return std::nullopt;
  return std::max(dialogue->next_tick(), not_before);
}

std::optional<Time> Connection::next_request() const {
  const auto request = finishing || dialogue == nullptr ? std::nullopt : dialogue->next_ping_request();
  return request ? std::optional(std::max(*request, not_before)) : std::nullopt;
}

Connection* Connections::find(ConnectionId id) {
  const auto it = std::find_if(all_.begin(), all_.end(), [&](const Connection& c) { return c.id == id; });
  return it == all_.end() ? nullptr : &*it;
}

std::size_t Connections::count(Role role, State state) const {
  return static_cast<std::size_t>(
      std::count_if(all_.begin(), all_.end(), [&](const Connection& c) { return c.role == role && c.state == state; }));
}

/// Returns the first served client, which is the oldest, because the list is in the order of arrival.
Connection* Connections::oldest_client() {
  const auto it = std::find_if(all_.begin(), all_.end(),
                               [](const Connection& c) { return c.role == Role::client && c.state == State::served; });
  return it == all_.end() ? nullptr : &*it;
}

// The list is in the order of arrival, so the first waiting connection has waited longest.
Connection* Connections::longest_waiting() {
  const auto it = std::find_if(all_.begin(), all_.end(), [](const Connection& c) { return c.state == State::waiting; });
  return it == all_.end() ? nullptr : &*it;
}

Connection* Connections::stream(std::size_t number) {
  for (Connection& c : all_)
    if (c.role == Role::stream && c.receivers.front().stream == number) return &c;
  return nullptr;
}

std::vector<protocol::Endpoint> Connections::receivers(const Connection& stream) const {
  const std::size_t number = stream.receivers.front().stream;
  std::vector<protocol::Endpoint> all;
  for (const Connection& c : all_) {
    // The device's own list belongs to the stream; the list of a client counts while the client is served.
    const bool counts = c.role == Role::stream ? c.id == stream.id : !c.finishing && c.state == State::served;
    for (const protocol::SetReceivers& list : c.receivers)
      for (const protocol::Endpoint& to : list.to)
        if (counts && list.stream == number && std::find(all.begin(), all.end(), to) == all.end()) all.push_back(to);
  }
  return all;
}

bool Connections::has_audience() const {
  return clients() > 0 || std::any_of(all_.begin(), all_.end(),
                                      [this](const Connection& c) { return c.role == Role::stream && !receivers(c).empty(); });
}

/// Ignores observers, because a slow observer must not delay stepped time.
bool Connections::settled() const {
  return std::all_of(all_.begin(), all_.end(),
                     [](const Connection& c) { return c.role == Role::observer || c.state != State::served || c.outbox.idle(); });
}

/// If no slot is free, the rule `when_full` determines the verdict: take over, queue or refuse. If the queue is full, clients are
/// refused.
Connections::Verdict Connections::verdict(Role role) const {
  if (role == Role::observer)
    return observers() < static_cast<std::size_t>(config_.max_observers) ? Verdict::serve : Verdict::refuse;
  if (clients() < static_cast<std::size_t>(config_.max_clients)) return Verdict::serve;
  if (config_.when_full == WhenClientsFull::take_over) return Verdict::take_over;
  const bool waits = config_.when_full == WhenClientsFull::queue && waiting() < longest_queue;
  return waits ? Verdict::wait : Verdict::refuse;
}

Connection& Connections::add(ConnectionId id, Role role, Peer peer, State state, const protocol::Port* port) {
  return all_.emplace_back(Connection{.id = id,
                                      .role = role,
                                      .peer = std::move(peer),
                                      .state = state,
                                      .port = port,
                                      .dialogue = nullptr,
                                      .outbox = Outbox(config_.outbox),
                                      .receivers = {},
                                      .held = {}});
}

void Connections::remove(ConnectionId id) {
  all_.remove_if([&](const Connection& c) { return c.id == id; });
}

}  // namespace sonar
