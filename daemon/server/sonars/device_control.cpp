// The part of Device for the control protocol: the status, and requests to the running device.
#include <algorithm>

#include "core/sonar/range_image.hpp"
#include "core/text/ipv4.hpp"
#include "daemon/server/sonars/device.hpp"
#include "protocol/control/answers.hpp"

namespace sonar {
namespace {

double ms(double seconds) { return 1e3 * seconds; }

void fill(v1::SonarFigures& out, const DeviceFigures& f) {
  out.set_pings(f.pings);
  out.set_refused(f.refused);
  out.set_served(f.served);
  out.set_dropped(f.dropped);
  out.set_skipped_ticks(f.skipped_ticks);
  out.set_clients(f.clients);
  out.set_refused_clients(f.refused_clients);
  out.set_simulation_ms(f.pings > 0 ? ms(f.simulation_s) / static_cast<double>(f.pings) : 0);
  out.set_latency_ms_p50(ms(f.latency.quantile_s(0.5)));
  out.set_latency_ms_p99(ms(f.latency.quantile_s(0.99)));
  out.set_late_ms_p99(ms(f.lateness.quantile_s(0.99)));
}

v1::Visit message_of(const Visit& visit) {
  v1::Visit out;
  out.set_address(visit.address);
  out.set_why(visit.why);
  out.set_utc_ns(std::chrono::nanoseconds(visit.at.time_since_epoch()).count());
  out.set_ago_s(seconds(std::chrono::steady_clock::now() - visit.noted));
  out.set_by_itself(visit.by_itself);
  out.set_without_ping(visit.without_ping);
  if (visit.connected_at) out.set_connected_s(seconds(std::chrono::steady_clock::now() - *visit.connected_at));
  return out;
}

/// Fills in the status of a client; `session` is null if the session has ended.
void fill(v1::ClientStatus& out, const Connection& c, Session* session) {
  out.set_address(c.peer.name);
  out.set_pings_written(c.pings_written());
  out.set_pings_dropped(c.outbox.pings_dropped());
  out.set_bytes_written(c.bytes_written + c.streamed_bytes);
  out.set_bytes_read(c.bytes_read);
  out.set_requests(static_cast<std::uint32_t>(c.requests));
  out.set_complaint(c.complaint);
  out.set_commands_only(c.is_for_commands());
  if (session == nullptr) return;
  out.set_connected_s(seconds(session->connected_for()));
  out.set_unread_s(seconds(session->stands_for()));
  out.set_taking(session->writes_ping());
  out.set_unsent_bytes(static_cast<std::uint32_t>(session->unconfirmed_bytes()));
}

}  // namespace

/// Returns the status that control, the live view and the doctor show.
v1::SonarStatus Device::status(Time now) const {
  const protocol::DeviceState& state = sonar_.state();
  const PingSettings& settings = sonar_.settings();
  const FrequencyMode& mode = state.model->modes[static_cast<std::size_t>(settings.mode)];
  v1::SonarStatus s;
  s.set_name(config().name);
  s.set_profile(state.model->profile);
  if (!tcp_ports_.empty()) s.set_listens(text_of(data_endpoint()));
  for (const protocol::DriverAddress& address : addresses()) {
    v1::SonarAddress& out = *s.add_addresses();
    out.set_protocol(std::string(address.protocol));
    out.set_address(text_of(address.at));
    out.set_sonar_speaks_first(address.sonar_speaks_first);
    out.set_carries(std::string(address.carries));
  }
  s.set_advertised(text_of(state.advertise_ip));
  for (const udp::endpoint& to : status_destinations())
    s.add_status_to(to.address().to_string() + ":" + std::to_string(to.port()));
  s.set_pinging(sonar_.wants_pings() && settings.rate_hz > 0);
  s.set_transmits(sonar_.transmits());
  s.set_range_m(settings.range_m);
  s.set_rate_hz(static_cast<double>(settings.rate_hz));
  s.set_on_request(settings.triggered);
  s.set_gain_db(static_cast<double>(settings.gain_db));
  s.set_frequency_hz(static_cast<double>(mode.centre_hz));
  s.set_beams(static_cast<std::uint32_t>(settings.beam_count));
  s.set_rows(static_cast<std::uint32_t>(settings.range_bin_count));
  control::set_pose(s, sonar_.pose_at(now));
  if (observer_listener_.at().port != 0) s.set_observers(text_of(observer_listener_.at()));
  s.set_observing(static_cast<std::uint32_t>(sonar_.connections().observers()));
  s.set_preview(preview_.on());
  for (const Connection& c : sonar_.connections().all()) {
    if (c.role == Role::observer && c.requests > 0) s.set_asking_observer(c.peer.name);
    if (c.role == Role::stream)
      for (const Endpoint& to : sonar_.connections().receivers(c)) s.add_receivers(text_of(to));
    if (c.role != Role::client || c.state != Connection::State::served) continue;
    v1::ClientStatus& client = *s.add_clients();
    fill(client, c, session_of(c.id).get());
    if (const StreamPointer dialogue = stream_of(c.id)) {
      client.set_connected_s(seconds(dialogue->connected_for()));
      client.set_silent_s(seconds(dialogue->silent_for()));
    }
  }
  s.set_asked_by(sonar_.asked_by());
  if (!sonar_.transmits()) s.set_silenced_by(silenced_by_);
  s.set_waiting(static_cast<std::uint32_t>(sonar_.connections().waiting()));
  if (refused_) *s.mutable_turned_away() = message_of(*refused_);
  if (gone_) *s.mutable_gone() = message_of(*gone_);
  if (searched_) *s.mutable_searched() = message_of(*searched_);
  fill(*s.mutable_figures(), figures());
  s.mutable_figures()->set_made_hz(preview_.on() ? preview_.hz(now) : made_.hz(now));
  return s;
}

v1::PingEvent Device::event_of(const PingQueued& queued) const {
  const PingRequest& r = queued.ping->request;
  v1::PingEvent e;
  e.set_sonar(config().name);
  e.set_number(static_cast<std::uint32_t>(r.number));
  e.set_fired_at_ns(r.fired_at.time_since_epoch().count());
  control::set_pose(e, r.sonar_in_world);
  e.set_range_m(r.settings.range_m);
  e.set_beams(static_cast<std::uint32_t>(r.settings.beam_count));
  e.set_rows(static_cast<std::uint32_t>(r.settings.range_bin_count));
  e.set_clients(static_cast<std::uint32_t>(sonar_.connections().clients()));
  e.set_simulation_ms(ms(queued.simulation_s));
  e.set_preview(queued.preview);
  return e;
}

std::string Device::problem() const {
  const bool lost = std::any_of(tcp_ports_.begin(), tcp_ports_.end(), [](const TcpPort& p) { return !p.listener.is_open(); }) ||
                    std::any_of(http_.begin(), http_.end(), [](const SonarHttp& http) { return !http.is_open(); });
  return lost && !stopping_ ? "sonar " + config().name + " does not listen any more" : "";
}

RecordedSonar Device::recorded() const {
  const protocol::Make* const make = protocol::find_make(sonar_.vendor().name());
  RecordedSonar sonar{config().name, std::string(sonar_.vendor().name()), {}};
  sonar.profile = sonar_.state().model->profile;
  const Connection* const client = sonar_.connections().oldest_client();
  const Ipv4 host = client != nullptr ? client->peer.ip : Ipv4{127, 0, 0, 1};
  sonar.ends = recording::usual_ends(make != nullptr ? *make : protocol::makes().front(),
                                     text::number_from_ipv4(sonar_.state().advertise_ip), text::number_from_ipv4(host));
  if (!tcp_ports_.empty()) sonar.ends.device.port = data_endpoint().port;
  const auto first = sonar_.vendor().initial_settings(sonar_.state());
  sonar.has_range_images = dynamic_cast<const RangeImageSettings*>(first.vendor_settings.get()) != nullptr;
  return sonar;
}

/// Checks settings first, so that neither transmission nor mount changes if the product refuses the settings.
Result<void> Device::ask(const control::SetSonar& asked, const std::string& who) {
  const Time now = network_.clock.now();
  const protocol::SettingsOverride wanted{asked.range_m, asked.rate_hz, asked.gain_percent, asked.mode, asked.beams};
  Actions actions;
  if (wanted.range_m || wanted.rate_hz || wanted.gain_percent || wanted.mode || wanted.beams) {
    auto changed = sonar_.change(wanted, who, now);
    if (!changed) return tl::make_unexpected(changed.error());
    actions = *std::move(changed);
  }
  if (asked.transmit && !*asked.transmit) silenced_by_ = who;
  if (asked.transmit && sonar_.set_transmit(*asked.transmit))
    network_.log.info(*asked.transmit ? "transmits again" : "does not transmit any more",
                      {{"sonar", config().name}, {"client", who}});
  if (asked.mount) {
    const Pose& old = config().mount;
    sonar_.move_mount({asked.mount->position_m.value_or(old.position_m), asked.mount->orientation.value_or(old.orientation)},
                      now);
  }
  perform(std::move(actions));
  return {};
}

void Device::use_water(const Water& water) {
  sonar_.use_water(water, network_.clock.now());
  perform({});
}

bool Device::end_faults(const std::string& name) {
  Actions actions;
  const bool found = sonar_.end_faults(name, network_.clock.now(), actions);
  perform(std::move(actions));
  return found;
}

std::vector<protocol::DriverAddress> Device::addresses() const {
  std::vector<Endpoint> status_to;
  for (const udp::endpoint& to : status_destinations()) status_to.push_back({to.address().to_v4().to_bytes(), to.port()});
  return protocol::driver_addresses(sonar_.vendor(), address_for_drivers(config()), status_to);
}

std::vector<StreamDigest> Device::digests() const {
  auto all = digests_;
  std::sort(all.begin(), all.end(), [](const StreamDigest& a, const StreamDigest& b) { return a.client < b.client; });
  return all;
}

}  // namespace sonar
