// Effects of faults on pings, on messages to clients, and on status messages.
#include <algorithm>
#include <cmath>
#include <span>

#include "daemon/emulator/faults/alter_message.hpp"
#include "daemon/emulator/faults/faults.hpp"

namespace sonar {
namespace {

using protocol::Bytes;

/// Returns all bytes of a message in the order in which they are sent: the shared bytes after each prefix, or once if there is no
/// prefix.
Bytes whole(const Outbox::Message& message) {
  Bytes all;
  if (message.prefixes.empty()) return *message.bytes;
  for (const Bytes& prefix : message.prefixes) {
    all.insert(all.end(), prefix.begin(), prefix.end());
    all.insert(all.end(), message.bytes->begin(), message.bytes->end());
  }
  return all;
}

/// Returns the time two seconds before the device's 32-bit counter overflows.
Time before_wrap(const std::string& unit, Time powered_up_at) {
  constexpr double counts = 4294967296.0, before_s = 2;
  const double unit_s = unit == "milliseconds" ? 1e-3 : 1e-6;
  return powered_up_at + std::chrono::nanoseconds(std::llround((counts * unit_s - before_s) * 1e9));
}

}  // namespace

/// Copies a ping only if a fault acts on it. Faults act in the order of their stages.
std::shared_ptr<const Ping> Faults::altered(const std::shared_ptr<const Ping>& ping, const protocol::DeviceState& state,
                                            Time now) {
  const auto number = static_cast<std::uint32_t>(ping->request.number);
  std::shared_ptr<Ping> changed;
  for (Entry& e : entries_) {
    const FaultStage stage = e.fault.kind->stage;
    const bool clock = stage == FaultStage::time && e.fault.kind->effect != Effect::clock_restart;
    if ((stage != FaultStage::payload && !clock) || !met(e, number)) continue;
    if (!changed) changed = std::make_shared<Ping>(*ping);
    Time& fired_at = changed->request.fired_at;
    const std::string& unit = e.fault.word("unit");
    if (!e.kept_time) e.kept_time = fired_at;
    if (!e.kept) e.kept = ping;
    const auto seconds_on = [](double s) { return std::chrono::nanoseconds(std::llround(s * 1e9)); };
    if (e.fault.kind->effect == Effect::clock_freeze)
      fired_at = *e.kept_time;
    else if (e.fault.kind->effect == Effect::clock_drift)
      fired_at += seconds_on(seconds(fired_at - *e.kept_time) * e.fault.number("ppm") * 1e-6);
    else if (clock && !unit.empty())
      fired_at = before_wrap(unit, state.powered_up_at) + (fired_at - *e.kept_time);
    else if (clock)
      fired_at += seconds_on(e.fault.number("seconds"));
    else
      alter_ping(e.fault, {around_.seed, e.key, around_.index, number, 0}, e.kept.get(), number - e.first_number.value_or(number),
                 *changed);
    FaultEntry more;
    more.ping = number;
    note(e, FaultEntry::What::injected, now, std::move(more));
  }
  if (!changed) return ping;
  look_at(*changed);
  return changed;
}

bool Faults::withholds(std::uint32_t ping, Time now) const {
  return std::any_of(entries_.begin(), entries_.end(), [&](const Entry& e) {
    const Effect effect = e.fault.kind->effect;
    if (effect == Effect::drop) return met(e, ping);
    if (!e.active) return false;
    return effect == Effect::withhold || effect == Effect::withhold_pings ||
           (effect == Effect::power_cycle && seconds(now - e.since) < e.fault.number("boot-s"));
  });
}

/// Returns false if the message must not be sent. Faults that silence the sonar act first, then faults that change the bytes or
/// their pace, or end the connection.
bool Faults::shape(const Connection& to, Outbox::Message& message, Time now) {
  if (entries_.empty() || to.role == Role::observer) return true;
  for (Entry& e : entries_) {
    const bool silent = e.active && (e.fault.kind->effect == Effect::withhold ||
                                     (e.fault.kind->effect == Effect::withhold_pings && message.ping != 0));
    if (!silent || !chosen(e.fault, to)) continue;
    note_message(e, to, message.ping, {}, {}, now, 0);
    return false;
  }
  if (message.ping == 0 || message.bytes == nullptr) return true;

  std::optional<MessageEdit> edit;
  for (Entry& e : entries_) {
    const FaultStage stage = e.fault.kind->stage;
    const bool of_message = stage == FaultStage::framing || stage == FaultStage::stream || stage == FaultStage::link;
    const bool joins = e.fault.kind->effect == Effect::join_late;
    const bool splices = e.fault.kind->effect == Effect::splice;
    if (!of_message || !chosen(e.fault, to)) continue;
    // A splice copies bytes of the previous message, so each message is kept, even if the fault did not act on its ping.
    const Bytes earlier = splices && !e.over ? std::exchange(e.before, whole(message)) : Bytes{};
    // A late join acts only on the first ping of a client.
    if (!(joins ? e.active : met(e, message.ping)) || (joins && to.outbox.pings_written() > 0)) continue;
    if (!edit) edit = MessageEdit{whole(message), {}, Outbox::Shape::End::none, false};
    const Bytes before = edit->bytes;
    const FaultDraws draws{around_.seed, e.key, around_.index, message.ping, static_cast<std::uint32_t>(to.number)};
    const Touch touch =
        alter_message(e.fault, {around_.vendor, draws, e.first_number.value_or(message.ping), message.ping, &earlier}, *edit);
    if (touch.acted) note_message(e, to, message.ping, before, edit->bytes, now, touch.place);
    if (edit->dropped) return false;
    if (edit->end != Outbox::Shape::End::none) break;  // the connection ends after this message
  }
  if (!edit) return true;
  message.bytes = std::make_shared<const Bytes>(std::move(edit->bytes));
  message.prefixes.clear();
  message.shape = nullptr;  // the positions in it refer to the unaltered bytes
  if (!edit->pauses.empty() || edit->end != Outbox::Shape::End::none) {
    std::sort(edit->pauses.begin(), edit->pauses.end(), [](const auto& a, const auto& b) { return a.before < b.before; });
    message.shape = std::make_shared<const Outbox::Shape>(Outbox::Shape{std::move(edit->pauses), edit->end});
  }
  return true;
}

void Faults::note_message(Entry& e, const Connection& to, std::uint32_t ping, const Bytes& before, const Bytes& after, Time now,
                          std::optional<std::size_t> place) {
  const auto differs = std::mismatch(before.begin(), before.end(), after.begin(), after.end()).first - before.begin();
  FaultEntry more;
  more.client = to.peer.name;
  more.client_number = to.number;
  more.ping = ping;
  more.offset = static_cast<std::int64_t>(to.bytes_written + place.value_or(static_cast<std::size_t>(differs)));
  more.bytes_before = before.size();
  more.bytes_after = after.size();
  note(e, FaultEntry::What::injected, now, std::move(more));
}

/// Changes bytes of a ping that is sent as datagrams: in the first datagram that has the field or region, or in every datagram if
/// the field has no fixed offset.
void Faults::alter_bytes_of_datagrams(std::vector<Bytes>& datagrams, const Connection& stream, std::uint32_t ping, Time now) {
  using protocol::Part;
  for (Entry& e : entries_) {
    if (e.fault.kind->stage != FaultStage::framing || datagrams.empty() || !chosen(e.fault, stream) || !met(e, ping)) continue;
    const auto name = e.fault.kind->field;
    const bool of_all = name && !around_.vendor.field(Part::ping, *name, {});
    const FaultDraws draws{around_.seed, e.key, around_.index, ping, 0};
    bool acted = false, dropped = false;
    for (Bytes& datagram : datagrams) {
      MessageEdit edit{datagram, {}, Outbox::Shape::End::none, false};
      const Touch touch = alter_message(e.fault, {around_.vendor, draws, e.first_number.value_or(ping), ping, nullptr}, edit);
      if (!touch.acted) continue;
      if (!std::exchange(acted, true)) note_message(e, stream, ping, datagram, edit.bytes, now, touch.place);
      datagram = std::move(edit.bytes);
      dropped = edit.dropped;
      if (!of_all) break;
    }
    if (dropped) datagrams.clear();
  }
}

/// True if faults of framing change bytes of this stream's datagrams.
bool Faults::frames_datagrams(const Connection& stream) const {
  return stream.role == Role::client || around_.vendor.pings_by() == protocol::PingsBy::datagrams;
}

bool Faults::alters_datagrams(const Connection& stream, std::uint32_t ping) const {
  return std::any_of(entries_.begin(), entries_.end(), [&](const Entry& e) {
    if (!chosen(e.fault, stream)) return false;
    if (e.fault.kind->stage == FaultStage::framing) return frames_datagrams(stream) && met(e, ping);
    if (e.fault.kind->stage != FaultStage::datagrams) return false;
    // older_part stores the first part of each ping; late_part sends a delayed part even after the end of the fault.
    const bool keeps = e.fault.kind->effect == Effect::older_part && !e.over;
    const bool holds = e.fault.kind->effect == Effect::late_part && !e.before.empty();
    return keeps || holds || met(e, ping);
  });
}

/// Applies faults that change bytes, then faults that lose, repeat or reorder datagrams.
void Faults::alter_datagrams(std::vector<Bytes>& datagrams, const Connection& stream, std::uint32_t ping, Time now) {
  if (frames_datagrams(stream)) alter_bytes_of_datagrams(datagrams, stream, ping, now);
  for (Entry& e : entries_) {
    if (e.fault.kind->stage != FaultStage::datagrams || datagrams.empty() || !chosen(e.fault, stream)) continue;
    // e.before is the first part of the previous ping (older_part), or the part that waits for this ping (late_part).
    const bool older = e.fault.kind->effect == Effect::older_part, delays = e.fault.kind->effect == Effect::late_part;
    Bytes late = delays ? std::exchange(e.before, {}) : Bytes{};
    if (e.over && e.hits.empty() && late.empty()) continue;
    const Bytes first = datagrams.front();
    if (met(e, ping)) {
      const FaultDraws draws{around_.seed, e.key, around_.index, ping, 0};
      const bool the_first = e.fault.word("which") == "first";
      const std::size_t part = the_first ? 0 : draws.below(datagrams.size(), 0);
      const auto at = datagrams.begin() + static_cast<std::ptrdiff_t>(part);
      const std::size_t before = datagrams.size();
      if (delays) e.before = *at;
      if (delays || e.fault.kind->effect == Effect::lose_part) datagrams.erase(at);
      if (e.fault.kind->effect == Effect::lose_last_part) datagrams.pop_back();
      if (e.fault.kind->effect == Effect::repeat_part) datagrams.insert(at, Bytes(*at));
      if (e.fault.kind->effect == Effect::reorder_parts) std::rotate(datagrams.begin(), datagrams.begin() + 1, datagrams.end());
      if (older && !e.before.empty()) datagrams.front() = e.before;
      FaultEntry more;
      more.client = stream.peer.name;
      more.ping = ping;
      more.bytes_before = before;
      more.bytes_after = datagrams.size();
      note(e, FaultEntry::What::injected, now, std::move(more));
    }
    if (older) e.before = first;
    // The delayed part follows the first part of this ping.
    if (!late.empty()) datagrams.insert(datagrams.begin() + (datagrams.empty() ? 0 : 1), std::move(late));
  }
}

/// Applies all active faults of status messages, one after the other.
void Faults::alter_beacons(std::vector<Bytes>& beacons, Time now) {
  if (entries_.empty() || beacons.empty()) return;
  on(Occasion::status, now);
  // First ends faults whose time is over, so that they do not alter this message.
  on_tick(now);
  const std::size_t size = beacons.front().size();
  for (Entry& e : entries_) {
    if (!e.active) continue;
    const Effect effect = e.fault.kind->effect;
    // The device is off until it has booted. With `keep-status`, a device that sends no pings still sends status messages.
    const bool off = (effect == Effect::power_cycle && seconds(now - e.since) < e.fault.number("boot-s")) ||
                     (effect == Effect::withhold && e.fault.word("keep-status") == "no");
    if (off) beacons.clear();
    if (e.fault.kind->stage != FaultStage::status && effect != Effect::heat) continue;
    sonar::alter_beacons(e.fault, around_.vendor,
                         {around_.seed, e.key, around_.index, static_cast<std::uint32_t>(e.injections), 0}, beacons);
    FaultEntry more;
    more.bytes_before = size;
    more.bytes_after = beacons.empty() ? 0 : beacons.front().size();
    note(e, FaultEntry::What::injected, now, std::move(more));
    if (e.fault.span.pings > 0 && effect != Effect::heat && --e.pings_left == 0) end(e, now);
  }
}

}  // namespace sonar
