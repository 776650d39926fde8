// A Device as the control protocol sees it: what it says of itself, and what may be asked of it while it runs.
#include <algorithm>

#include "core/text/ipv4.hpp"
#include "daemon/server/sonars/device.hpp"

namespace sonar {
namespace {

double ms(double seconds) { return 1e3 * seconds; }

control::SonarFigures figures_of(const DeviceFigures& f) {
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

}  // namespace

control::SonarStatus Device::status(Time now) const {
  const protocol::DeviceState& state = sonar_.state();
  const PingSettings& settings = sonar_.settings();
  const FrequencyMode& mode = state.model->modes[static_cast<std::size_t>(settings.mode)];
  control::SonarStatus s;
  s.name = config().name;
  s.profile = state.model->profile;
  if (!tcp_ports_.empty()) s.listens = text_of(data_endpoint());
  s.advertised = text_of(state.advertise_ip);
  for (const udp::endpoint& to : status_destinations())
    s.status_to.push_back(to.address().to_string() + ":" + std::to_string(to.port()));
  s.pinging = sonar_.wants_pings() && settings.rate_hz > 0;
  s.transmits = sonar_.transmits();
  s.range_m = settings.range_m;
  s.rate_hz = static_cast<double>(settings.rate_hz);
  s.gain_db = static_cast<double>(settings.gain_db);
  s.frequency_hz = static_cast<double>(mode.centre_hz);
  s.beams = static_cast<std::uint32_t>(settings.beam_count);
  s.rows = static_cast<std::uint32_t>(settings.range_bin_count);
  s.in_world = sonar_.pose_at(now);
  if (observer_listener_.at().port != 0) s.observers = text_of(observer_listener_.at());
  s.observing = static_cast<std::uint32_t>(sonar_.connections().observers());
  for (const Connection& c : sonar_.connections().all()) {
    if (c.role != Role::client || c.state != Connection::State::served) continue;
    const SessionPointer session = session_of(c.id);
    const double connected_s = session ? seconds(session->connected_for()) : 0;
    s.clients.push_back({c.peer.name, c.outbox.pings_written(), c.outbox.pings_dropped(), c.bytes_written, connected_s});
  }
  s.figures = figures_of(figures());
  return s;
}

std::string Device::problem() const {
  const bool lost = std::any_of(tcp_ports_.begin(), tcp_ports_.end(), [](const TcpPort& p) { return !p.listener.is_open(); }) ||
                    std::any_of(http_.begin(), http_.end(), [](const SonarHttp& http) { return !http.is_open(); });
  return lost && !stopping_ ? "sonar " + config().name + " does not listen any more" : "";
}

RecordedSonar Device::recorded() const {
  RecordedSonar sonar{config().name, std::string(sonar_.vendor().name()), {}};
  sonar.ends.device = {text::number_from_ipv4(sonar_.state().advertise_ip), data_endpoint().port};
  sonar.ends.status_from.address = sonar.ends.device.address;
  if (const Connection* const client = sonar_.connections().oldest_client())
    sonar.ends.client.address = text::number_from_ipv4(client->peer.ip);
  return sonar;
}

Result<void> Device::ask(const control::SetSonar& asked, const std::string& who) {
  const Time now = network_.clock.now();
  const protocol::SettingsOverride wanted{asked.range_m, asked.rate_hz, asked.gain_percent, asked.mode, asked.beams};
  Actions actions;
  if (wanted.range_m || wanted.rate_hz || wanted.gain_percent || wanted.mode || wanted.beams) {
    auto changed = sonar_.change(wanted, who, now);
    if (!changed) return tl::make_unexpected(changed.error());
    actions = *std::move(changed);
  }
  if (asked.transmit && sonar_.set_transmit(*asked.transmit))
    network_.log.info(*asked.transmit ? "transmits again" : "does not transmit any more",
                      {{"sonar", config().name}, {"client", who}});
  if (asked.mount) sonar_.move_mount(*asked.mount, now);
  perform(std::move(actions));
  return {};
}

void Device::use_water(const Water& water) {
  sonar_.use_water(water, network_.clock.now());
  perform({});
}

}  // namespace sonar
