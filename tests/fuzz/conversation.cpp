#include "tests/fuzz/conversation.hpp"

#include <algorithm>
#include <chrono>

#include "clients/bvtsdk/core/polar_ping.hpp"
#include "tests/fuzz/byte_script.hpp"

namespace sonar::fuzz {
namespace {

using namespace std::chrono_literals;
using protocol::Bytes;
using protocol::BytesView;

constexpr std::size_t largest_framed = 8u << 10;  // bytes of a BlueView ping that is really framed: a thousand runs a second
constexpr int most_rows = 2;                      // of an Oculus ping, for the same reason
constexpr std::size_t most_copies = 9;            // of one ping for one client: eight triggers and a subscription
constexpr auto longest_silence = 1h;              // until the next tick

/// A ping's payload for a BlueView host, of one sample.
Bytes smallest_polar_ping(std::uint32_t number) {
  bvt::PolarPing ping;
  ping.number = number;
  ping.stop_m = 1, ping.bin_m = 1;
  ping.fov_min_deg = -45, ping.fov_max_deg = 45;
  ping.beams = ping.bins = 1;
  ping.samples = {7};
  Bytes out;
  for (const std::uint8_t b : bvt::encode_ping(ping)) out.push_back(static_cast<std::byte>(b));
  return out;
}

}  // namespace

Conversation::Conversation(const protocol::Profile& profile, const protocol::OptionValues& options, OutboxRules rules)
    : vendor_(*profile.vendor), rules_(rules), now_(Time{} + std::chrono::hours(24 * 365 * 50)) {
  device.name = "front";
  device.id = 7001;
  device.model = profile.model;
  device.powered_up_at = now_;
  device.water = Water{15, 0, 8, 0};
  device.options = protocol::check_options(vendor_, options).value();
  const protocol::ChangeSettings initial = vendor_.initial_settings(device);
  device.request = initial.request;
  settings_ = initial.settings;
}

void Conversation::connect(std::size_t place) {
  if (clients_[place]) return;
  auto reader = vendor_.name() == "oculus" ? oculus_reader() : blueview_reader();
  clients_[place].emplace(Client{vendor_.converse(device, now_), Outbox(rules_), std::move(reader)});
}

void Conversation::receive(std::size_t place, BytesView bytes) {
  if (!clients_[place] || clients_[place]->finishing) return;
  // Exactly as large as it is, so that a sanitizer sees one byte too many.
  const std::vector<std::byte> exact(bytes.begin(), bytes.end());
  handle(place, clients_[place]->dialogue->on_bytes(exact, now_));
}

void Conversation::on_event(const protocol::Event& event) {
  if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
    device.request = change->request;
    settings_ = change->settings;
    require(settings_.mode >= 0 && static_cast<std::size_t>(settings_.mode) < device.model->modes.size());
    require(settings_.range_bin_count >= 1 && settings_.beam_count >= 1 && settings_.range_bin_m > 0);
  } else if (const auto* store = std::get_if<protocol::StoreAddress>(&event)) {
    device.stored_address = store->address;
  }
}

void Conversation::handle(std::size_t place, protocol::Reaction reaction) {
  Client& client = *clients_[place];
  bool close = false;
  for (const protocol::Event& event : reaction.events) {
    close = close || std::holds_alternative<protocol::Close>(event);
    on_event(event);
  }
  for (Bytes& reply : reaction.replies) {
    require(!reply.empty());
    if (!client.outbox.push_reply(std::move(reply))) return disconnect(place);
  }
  if (close) finish(place);
}

void Conversation::tick(std::size_t place) {
  if (!clients_[place] || clients_[place]->finishing) return;
  protocol::Dialogue& dialogue = *clients_[place]->dialogue;
  require(dialogue.next_tick() <= now_ + longest_silence);
  now_ = std::max(now_, dialogue.next_tick());
  tick_all_due();
}

/// A dialogue that is ticked when it wants to be asks for a later time before long; else the daemon would spin.
void Conversation::tick_all_due() {
  for (std::size_t place = 0; place < places; ++place) {
    for (int n = 0; clients_[place] && !clients_[place]->finishing && clients_[place]->dialogue->next_tick() <= now_; ++n) {
      require(n < 4);
      handle(place, clients_[place]->dialogue->on_tick(now_));
    }
  }
}

void Conversation::wait(std::chrono::nanoseconds time) {
  const Time until = now_ + time;
  for (int steps = 0; steps < 50; ++steps) {
    Time next = until;
    for (const auto& client : clients_)
      if (client && !client->finishing) next = std::min(next, client->dialogue->next_tick());
    if (next >= until) break;
    now_ = std::max(now_, next);
    tick_all_due();
  }
  now_ = until;  // the rest at once, as after SIGSTOP and SIGCONT
  tick_all_due();
}

std::shared_ptr<const Bytes> Conversation::framed() const {
  Ping ping;
  ping.request.model = device.model;
  ping.request.number = PingNumber{pings_};
  ping.request.fired_at = now_;
  ping.request.water = device.water;
  ping.request.settings = settings_;
  PingSettings& s = ping.request.settings;
  const bool oculus = vendor_.name() == "oculus";
  if (oculus) s.range_bin_count = std::min(s.range_bin_count, most_rows);
  const auto beams = static_cast<std::size_t>(s.beam_count), rows = static_cast<std::size_t>(s.range_bin_count);
  const std::size_t size = beams * rows * static_cast<std::size_t>(s.format.bits) / 8;
  if (!oculus && size > largest_framed) return std::make_shared<const Bytes>(smallest_polar_ping(pings_));
  for (std::size_t b = 0; b < beams; ++b)
    ping.beam_azimuth_rad.push_back(0.5f - static_cast<float>(b) / static_cast<float>(beams));
  ping.samples.resize(size);
  if (s.format.row_gains) ping.row_gain.assign(rows, 1);
  return vendor_.frame(ping, device, device.request);
}

void Conversation::fire() {
  ++pings_;
  const auto bytes = framed();
  const Bytes made_with = device.request;
  for (auto& client : clients_) {
    if (!client || client->finishing) continue;
    protocol::Delivery delivery = client->dialogue->on_ping(made_with, bytes->size(), now_);
    require(delivery.prefixes.size() <= most_copies);
    if (!delivery.prefixes.empty()) {
      const bool as_it_is = delivery.prefixes.size() == 1 && delivery.prefixes.front().empty();
      client->outbox.push_ping(bytes, pings_, as_it_is ? std::vector<Bytes>{} : std::move(delivery.prefixes));
      ++client->pings_offered;
    }
    for (const protocol::Event& event : delivery.events) on_event(event);
    check(*client);
  }
}

/// The next piece of what is being written; false when there is nothing.
bool Conversation::write_piece(Client& client, std::size_t& bytes) {
  if (!client.writing) {
    client.writing = client.outbox.take();
    client.part = client.done = 0;
    if (!client.writing) return false;
    require(!client.outbox.take());  // one at a time
  }
  // Prefix, bytes, prefix, bytes: even parts are prefixes.
  const auto& prefixes = client.writing.prefixes;
  const std::size_t parts = prefixes.empty() ? 1 : 2 * prefixes.size();
  const Bytes& from = !prefixes.empty() && client.part % 2 == 0 ? prefixes[client.part / 2] : *client.writing.bytes;
  const std::size_t n = std::min(bytes, from.size() - client.done);
  client.reader->read(BytesView(from).subspan(client.done, n));
  client.done += n;
  bytes -= n;
  if (client.done < from.size()) return bytes > 0;
  client.done = 0;
  if (++client.part < parts) return bytes > 0;
  client.writing = {};
  client.outbox.written();
  require(client.reader->at_a_message_end());
  return bytes > 0;
}

void Conversation::write(std::size_t place, std::size_t bytes) {
  if (!clients_[place]) return;
  while (write_piece(*clients_[place], bytes)) {
  }
  check(*clients_[place]);
}

void Conversation::check(const Client& client) const {
  const std::uint64_t gone = client.outbox.pings_written() + client.outbox.pings_dropped();
  require(gone <= client.pings_offered);
  require(client.pings_offered - gone <= static_cast<std::uint64_t>(rules_.depth) + 1);  // waiting, and the one being written
}

void Conversation::finish(std::size_t place) {
  if (!clients_[place]) return;
  clients_[place]->finishing = true;
  clients_[place]->outbox.drop_waiting_pings();
}

/// In the middle of whatever it was: pings offered are written, dropped or still there.
void Conversation::disconnect(std::size_t place) {
  if (!clients_[place]) return;
  Client& client = *clients_[place];
  check(client);
  if (client.writing) client.outbox.written();
  while (client.outbox.take()) client.outbox.written();
  require(client.outbox.idle());
  require(client.outbox.pings_written() + client.outbox.pings_dropped() == client.pings_offered);
  clients_[place].reset();
}

void Conversation::end() {
  for (std::size_t place = 0; place < places; ++place) {
    if (!clients_[place]) continue;
    write(place, ~std::size_t{0});
    require(clients_[place]->outbox.idle() && clients_[place]->reader->at_a_message_end());
    disconnect(place);
  }
}

}  // namespace sonar::fuzz
