#include "tests/fuzz/sonar_clients.hpp"

#include <algorithm>
#include <chrono>

#include "clients/bvtsdk/core/polar_ping.hpp"
#include "daemon/emulator/world/world_parts.hpp"
#include "tests/fuzz/byte_script.hpp"
#include "tests/fuzz/sonar_accounts.hpp"
#include "tests/protocol/delegating_vendor.hpp"

namespace sonar::fuzz {
namespace {

using namespace std::chrono_literals;
using protocol::Bytes;
using protocol::BytesView;

constexpr std::size_t largest_framed =
    8u << 10;                         // largest BlueView ping that is really framed, to allow a thousand runs per second
constexpr int most_rows = 2;          // rows of an Oculus ping, for the same reason
constexpr auto longest_silence = 1h;  // limit of the time until the next tick
constexpr Time start = Time{} + std::chrono::hours(24 * 365 * 50);

/// Returns the payload of a ping with one sample, for a BlueView host.
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

/// A make that replaces large pings with small ones.
class SmallPings final : public protocol::DelegatingVendor {
 public:
  using DelegatingVendor::DelegatingVendor;
  std::shared_ptr<const Bytes> frame(const Ping& ping, const protocol::DeviceState& device) const override {
    const bool small = name() == "oculus" || !ping.samples.empty();
    return small ? DelegatingVendor::frame(ping, device)
                 : std::make_shared<const Bytes>(smallest_polar_ping(static_cast<std::uint32_t>(ping.request.number)));
  }
};

std::shared_ptr<const Ping> computed(PingRequest request) {
  auto ping = std::make_shared<Ping>();
  PingSettings& s = request.settings;
  require(s.mode >= 0 && static_cast<std::size_t>(s.mode) < request.model->modes.size());
  require(s.range_bin_count >= 1 && s.beam_count >= 1 && s.range_bin_m > 0);
  const bool oculus = request.model->profile.starts_with("oculus");
  if (oculus) s.range_bin_count = std::min(s.range_bin_count, most_rows);
  const auto beams = static_cast<std::size_t>(s.beam_count), rows = static_cast<std::size_t>(s.range_bin_count);
  const std::size_t size = beams * rows * static_cast<std::size_t>(s.format.bits) / 8;
  if (oculus || size <= largest_framed) ping->samples.resize(size);
  for (std::size_t b = 0; b < beams; ++b)
    ping->beam_azimuth_rad.push_back(0.5f - static_cast<float>(b) / static_cast<float>(beams));
  if (s.format.row_gains) ping->row_gain.assign(rows, 1);
  ping->request = std::move(request);
  return ping;
}

Config surroundings() {
  Config config;
  config.clock = ClockMode::stepped;
  config.water = Water{15, 0, 8, 0};
  config.vehicles.push_back({.name = "rov", .initial_pose = {{0, 0, -3}, {}}});
  return config;
}

SonarConfig with_vendor(SonarConfig sonar, const protocol::Vendor& vendor) {
  sonar.profile.vendor = &vendor;
  return sonar;
}

}  // namespace

SonarClients::SonarClients(SonarConfig sonar)
    : vendor_(std::make_unique<SmallPings>(*sonar.profile.vendor)),
      config_(surroundings()),
      world_(pose_rules(config_), vehicles_of(config_), {}, start),
      now_(start),
      sonar_({config_, world_}, with_vendor(std::move(sonar), *vendor_), 0, start) {}

std::optional<std::size_t> SonarClients::place_of(ConnectionId id) const {
  for (std::size_t place = 0; place < places; ++place)
    if (clients_[place] && clients_[place]->id == id) return place;
  return std::nullopt;
}

void SonarClients::perform(Actions actions) {
  for (Action& action : actions) {
    if (auto* compute = std::get_if<ComputePing>(&action)) {
      require(!computing_);
      computing_ = std::move(compute->request);
    } else if (const auto* serve = std::get_if<Serve>(&action)) {
      clients_[*place_of(serve->connection)]->served = true;
    } else if (const auto* away = std::get_if<Refuse>(&action)) {
      clients_[*place_of(away->connection)].reset();
    } else if (const auto* finish = std::get_if<Finish>(&action)) {
      clients_[*place_of(finish->connection)]->finishing = true;
    } else if (const auto* reset = std::get_if<Reset>(&action)) {
      require(reset->why != "an internal fault");
      if (const auto place = place_of(reset->connection)) disconnect(*place);
    }
    require(!std::holds_alternative<EngineFailed>(action));
  }
  check();
}

void SonarClients::connect(std::size_t place, Role role) {
  if (clients_[place]) return;
  clients_[place].emplace(
      Client{.id = ++last_id_, .reader = sonar_.vendor().name() == "oculus" ? oculus_reader() : blueview_reader()});
  perform(sonar_.on_connect(last_id_, role, {"client " + std::to_string(last_id_), {127, 0, 0, 1}}, now_));
}

void SonarClients::receive(std::size_t place, BytesView bytes) {
  if (!clients_[place] || !clients_[place]->served) return;
  // A buffer of exactly the input's size, so that a sanitizer detects a read beyond it.
  const std::vector<std::byte> exact(bytes.begin(), bytes.end());
  perform(sonar_.on_bytes(clients_[place]->id, exact, now_));
}

void SonarClients::tick(std::size_t place) {
  if (!clients_[place]) return;
  const Connection* const connection = sonar_.connections().find(clients_[place]->id);
  const auto next = connection->next_tick();
  if (!next || *next == Time::max()) return;  // no event is due before bytes or a ping arrive
  require(*next <= now_ + longest_silence);
  now_ = std::max(now_, *next);
  tick_all_due();
}

/// After some ticks a conversation must state a later time for the next; otherwise the daemon would loop without pause.
void SonarClients::tick_all_due() {
  for (int n = 0;; ++n) {
    perform(sonar_.on_tick(now_));
    const auto& all = sonar_.connections().all();
    const bool due = std::any_of(all.begin(), all.end(), [&](const Connection& c) {
      return !c.finishing && c.dialogue != nullptr && c.dialogue->next_tick() <= now_;
    });
    if (!due) return;
    require(n < 4);
  }
}

void SonarClients::wait(std::chrono::nanoseconds time) {
  const Time until = now_ + time;
  for (int steps = 0; steps < 50; ++steps) {
    const auto next = sonar_.next_tick();
    if (!next || *next >= until) break;
    now_ = std::max(now_, *next);
    tick_all_due();
  }
  now_ = until;  // all events become due at once, as after SIGSTOP and SIGCONT
  tick_all_due();
}

void SonarClients::fire() {
  if (!computing_) {
    const auto next = sonar_.next_ping();
    if (!next) return;
    now_ = std::max(now_, *next);
    perform(sonar_.tick_pacer(now_));
  }
  if (!computing_) return;
  const auto ping = computed(*std::exchange(computing_, std::nullopt));
  perform(sonar_.on_ping({.ping = ping, .seconds = 0.01}, now_));
}

/// Gives the client the next piece of its message. Returns false if there is none, or when `bytes` are used up.
bool SonarClients::write_piece(Client& client, std::size_t& bytes) {
  if (!client.writing) {
    client.writing = sonar_.next_message(client.id, now_);
    client.part = client.done = 0;
    if (!client.writing) return false;
    require(!sonar_.next_message(client.id, now_));  // no further message while one is being written
  }
  // Even parts are prefixes; each is followed by the bytes of the message.
  const auto& prefixes = client.writing.prefixes;
  const std::size_t parts = prefixes.empty() ? 1 : 2 * prefixes.size();
  const Bytes& from = !prefixes.empty() && client.part % 2 == 0 ? prefixes[client.part / 2] : *client.writing.bytes;
  require(!from.empty());
  const std::size_t n = std::min(bytes, from.size() - client.done);
  client.reader->read(BytesView(from).subspan(client.done, n));
  sonar_.on_sent(client.id, n);
  client.done += n;
  bytes -= n;
  if (client.done < from.size()) return bytes > 0;
  client.done = 0;
  if (++client.part < parts) return bytes > 0;
  sonar_.on_written(client.id, std::exchange(client.writing, {}), now_);
  require(client.reader->at_a_message_end());
  return bytes > 0;
}

void SonarClients::write(std::size_t place, std::size_t bytes) {
  if (!clients_[place] || !clients_[place]->served) return;
  while (write_piece(*clients_[place], bytes)) {
  }
  check();
}

void SonarClients::check() const { check_accounts(sonar_); }

void SonarClients::finish(std::size_t place) {
  if (!clients_[place] || !clients_[place]->served) return;
  clients_[place]->finishing = true;
  perform(sonar_.finish(clients_[place]->id, now_));
}

/// Disconnects at any point, also within a message.
void SonarClients::disconnect(std::size_t place) {
  if (!clients_[place]) return;
  const ConnectionId id = clients_[place]->id;
  clients_[place].reset();
  perform(sonar_.on_closed(id, "gone", now_));
  require(sonar_.connections().find(id) == nullptr);
}

void SonarClients::end() {
  perform(sonar_.stop("the end"));
  for (std::size_t place = 0; place < places; ++place) {
    if (!clients_[place]) continue;
    write(place, ~std::size_t{0});
    require(!clients_[place]->served || clients_[place]->reader->at_a_message_end());
    disconnect(place);
  }
  const DeviceFigures f = sonar_.figures();
  require(sonar_.connections().empty() && f.offered == f.sent + f.dropped && f.waiting == 0);
}

}  // namespace sonar::fuzz
