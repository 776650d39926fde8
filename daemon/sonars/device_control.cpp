// A Device as the control protocol sees it: what it says of itself, and what may be asked of it while it runs.
#include "daemon/sonars/device.hpp"

namespace sonar {
namespace {

double ms(double seconds) { return 1e3 * seconds; }

control::SonarFigures told(const DeviceFigures& f) {
  control::SonarFigures out;
  out.pings = f.pings;
  out.refused = f.refused;
  out.served = f.served;
  out.dropped = f.dropped;
  out.skipped_ticks = f.skipped_ticks;
  out.clients = f.clients;
  out.refused_clients = f.refused_clients;
  out.simulation_ms = f.pings > 0 ? ms(f.simulation_s) / static_cast<double>(f.pings) : 0;
  out.latency_ms_p50 = ms(f.latency.quantile_s(0.5));
  out.latency_ms_p99 = ms(f.latency.quantile_s(0.99));
  out.late_ms_p99 = ms(f.lateness.quantile_s(0.99));
  return out;
}

control::ClientStatus told(const Session& s) {
  return {s.client(), s.outbox().pings_written(), s.outbox().pings_dropped(), s.bytes_written(), seconds(s.connected_for())};
}

}  // namespace

control::SonarStatus Device::status(Time now) const {
  const FrequencyMode& mode = state_.model->modes[static_cast<std::size_t>(settings_.mode)];
  control::SonarStatus s;
  s.name = config_.name;
  s.profile = state_.model->profile;
  s.listens = text_of(Endpoint{config_.bind_ip, data_endpoint().port()});
  s.advertised = text_of(state_.advertise_ip);
  for (const udp::endpoint& to : status_to_) s.status_to.push_back(to.address().to_string() + ":" + std::to_string(to.port()));
  s.pinging = wants_pings() && settings_.rate_hz > 0;
  s.transmits = transmits_;
  s.range_m = settings_.range_m;
  s.rate_hz = static_cast<double>(settings_.rate_hz);
  s.gain_db = static_cast<double>(settings_.gain_db);
  s.frequency_hz = static_cast<double>(mode.centre_hz);
  s.beams = static_cast<std::uint32_t>(settings_.beam_count);
  s.rows = static_cast<std::uint32_t>(settings_.range_bin_count);
  s.in_world = compose(context_.world.vehicle_at(config_.vehicle, now), config_.mount);
  if (const Endpoint at = observers_.at(); at.port != 0) s.observers = text_of(at);
  s.observing = static_cast<std::uint32_t>(observers_.count());
  for (const SessionPointer& client : sessions_) s.clients.push_back(told(*client));
  s.figures = told(figures());
  return s;
}

std::string Device::trouble() const {
  const bool lost = !stopping_ && !acceptor_.is_open();
  return lost ? "sonar " + config_.name + " does not listen any more" : "";
}

RecordedSonar Device::recorded() const {
  const auto number = [](Ipv4 ip) {
    return std::uint32_t{ip[0]} << 24 | std::uint32_t{ip[1]} << 16 | std::uint32_t{ip[2]} << 8 | std::uint32_t{ip[3]};
  };
  RecordedSonar sonar{config_.name, std::string(vendor_.name()), {}};
  sonar.ends.device = {number(state_.advertise_ip), data_endpoint().port()};
  sonar.ends.status_from.address = sonar.ends.device.address;
  if (!sessions_.empty()) sonar.ends.client.address = number(sessions_.front()->client_ip());
  return sonar;
}

/// Clients have it in their outboxes by now: what becomes of the files is nothing to them.
void Device::record(const Simulator::Outcome& outcome, const std::shared_ptr<const protocol::Bytes>& bytes, Time now) const {
  if (!context_.recordings.takes(config_.name)) return;
  context_.recordings.take(config_.name, {now, outcome.ping, bytes, vendor_.beacon(state_, now), under_way_names_});
}

Result<void> Device::ask(const control::SetSonar& asked, const std::string& who) {
  protocol::Wish wish{asked.range_m, asked.rate_hz, asked.gain_percent, asked.mode, asked.beams};
  const bool wishes = wish.range_m || wish.rate_hz || wish.gain_percent || wish.mode || wish.beams;
  if (wishes) {
    const auto change = vendor_.wished(wish, state_);
    if (!change) return tl::make_unexpected(change.error());
    change_settings(*change, who);
  }
  if (asked.transmit && std::exchange(transmits_, *asked.transmit) != *asked.transmit)
    context_.log.info(transmits_ ? "transmits again" : "does not transmit any more", {{"sonar", config_.name}, {"client", who}});
  if (asked.mount) {
    config_.mount = *asked.mount;
    update_state(context_.clock.now());
  }
  arm();
  context_.on_change();
  return {};
}

void Device::use_place(const SonarConfig& config) {
  config_.vehicle = config.vehicle;
  config_.mount = config.mount;
  update_state(context_.clock.now());
}

void Device::use_water(const Water& water) {
  state_.water = water;
  // The request that holds stays; what the device works out of it by itself, its sound speed say, follows the water.
  if (const auto same = vendor_.wished({}, state_)) settings_ = same->settings;
  if (wants_pings()) pacer_.configure(settings_, context_.clock.now());
  arm();
}

void Device::tell_of_ping(const Ping& ping, double simulation_s) const {
  if (!context_.events.heard()) return;
  const PingRequest& r = ping.request;
  control::PingEvent e;
  e.sonar = config_.name;
  e.number = static_cast<std::uint32_t>(r.number);
  e.fired_at_ns = r.fired_at.time_since_epoch().count();
  e.sonar_in_world = r.sonar_in_world;
  e.range_m = r.settings.range_m;
  e.beams = static_cast<std::uint32_t>(r.settings.beam_count);
  e.rows = static_cast<std::uint32_t>(r.settings.range_bin_count);
  e.clients = static_cast<std::uint32_t>(sessions_.size());
  e.simulation_ms = ms(simulation_s);
  context_.events.tell({e});
}

void Device::tell_of_client(const Session& session, bool connected, const std::string& why) const {
  if (context_.events.heard()) context_.events.tell({control::ClientEvent{config_.name, session.client(), connected, why}});
}

}  // namespace sonar
