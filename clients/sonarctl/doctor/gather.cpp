#include <algorithm>

#include "clients/sonarctl/doctor/facts.hpp"
#include "clients/sonarctl/doctor/probes.hpp"
#include "clients/sonarctl/ping_stream.hpp"
#include "protocol/control/answers.hpp"

namespace sonar::clients::doctor {
namespace {

using namespace std::chrono_literals;

constexpr auto status_patience = 2500ms;  // status messages come every second
constexpr auto first_status = 1300ms;     // for the first status, which names the connected client
const Endpoint usual_http{"127.0.0.1", 8088};
constexpr auto short_patience = 700ms, own_patience = 200ms;
constexpr auto search_patience = 400ms, search_patience_here = 100ms;  // for an answer to discovery

/// Port of the sonars that announce themselves with status messages.
const std::uint16_t usual_port = protocol::makes().front().ports.front().number;

class Gathering {
 public:
  explicit Gathering(const Questions& questions)
      : questions_(questions),
        deadline_(start_ + std::chrono::milliseconds(static_cast<std::int64_t>(1000 * questions.within_s))),
        status_(questions.status_on) {}

  Result<Facts> run() {
    facts_.address_given = !questions_.address.empty();
    const auto control = parse_endpoint(questions_.control, {"127.0.0.1", control_port});
    const auto http = parse_endpoint(questions_.http, usual_http);
    auto given = parse_endpoint(questions_.address, {"127.0.0.2", 0});
    if (!control) return tl::unexpected(control.error());
    if (!http) return tl::unexpected(http.error());
    if (!given) return tl::unexpected(given.error());

    ask_control(*control);
    ask_http(*http);
    given->host = ipv4_of(given->host).value_or(given->host);  // examine() reports a name without an address
    const DiscoveryQuestion search(facts_.address_given ? std::vector{given->host} : std::vector<std::string>{});
    const auto sockets = tcp_sockets(), by_udp = udp_sockets();
    const auto programs = programs_by_socket();
    note_daemons(sockets, by_udp, programs);
    find_sonars(*given, search);
    for (SonarFacts& sonar : facts_.sonars) examine(sonar, sockets, by_udp, programs);
    listen_to_all();
    search.receive_answers(facts_.found, Steady::now());
    facts_.kernel_ports = kernel_ports();
    facts_.machine = this_machine();
    return std::move(facts_);
  }

 private:
  std::chrono::milliseconds until(std::chrono::milliseconds patience) const { return std::min(patience, left_until(deadline_)); }
  Steady::time_point no_later_than(Steady::time_point moment) const { return std::min(moment, deadline_); }

  void ask_control(const Endpoint& at) {
    facts_.control.at = at;
    facts_.control.given = !questions_.control.empty();
    const auto patience = at.host.starts_with("127.") ? own_patience : short_patience;
    auto client = ControlClient::open({text_from(at), questions_.token_file, until(patience)}, &facts_.control.token_required);
    if (!client) {
      facts_.control.error = client.error().text;
      return;
    }
    auto status = client->status(until(short_patience));
    if (!status) {
      facts_.control.error = status.error().text;
      return;
    }
    facts_.control.status = std::move(*status);
    if (facts_.control.status->clock() == "realtime" &&
        client->request(control::Subscribe{true, false, false, false}, until(short_patience)))
      control_.emplace(std::move(*client));
  }

  /// Requests /healthz at the address that the user gave, else at the one that the daemon reported, else at the default.
  void ask_http(Endpoint at) {
    const bool given = !questions_.http.empty();
    const auto& status = facts_.control.status;
    if (!given && status && !status->control().empty()) {  // older versions report neither
      at = parse_endpoint(status->http(), usual_http).value_or(usual_http);
      if (at.host == "0.0.0.0") at.host = facts_.control.at.host;
      facts_.http.at = at;
      if (status->http().empty()) facts_.http.place = HttpFacts::Place::not_served;
      const auto daemon = ipv4_of(facts_.control.at.host);
      const bool another_computer = daemon && !is_on_this_host(*daemon);
      if (at.host.starts_with("127.") && another_computer) facts_.http.place = HttpFacts::Place::only_over_there;
      if (facts_.http.place != HttpFacts::Place::asked) return;
    }
    facts_.http = ask_health(at, given, until(at.host.starts_with("127.") ? own_patience : short_patience));
  }

  /// Lists the sonard processes that listen on ports of sonars.
  void note_daemons(const std::vector<SocketLine>& sockets, const std::vector<SocketLine>& by_udp,
                    const std::map<std::uint64_t, Program>& programs) {
    const auto note = [&](const SocketLine& socket) {
      PortHolder holder = holder_of(socket, programs);
      if (holder.program == "sonard") facts_.daemons.push_back(std::move(holder));
    };
    for (const SocketLine& socket : sockets)
      if (socket.state == listening && make_at(socket.local_port) != nullptr) note(socket);
    for (const SocketLine& socket : by_udp)
      if (const Make* const make = make_at(socket.local_port); make != nullptr && make->is_by_udp()) note(socket);
  }

  void find_sonars(const Endpoint& given, const DiscoveryQuestion& search) {
    if (facts_.address_given) {
      const auto patience = is_on_this_host(given.host) ? search_patience_here : search_patience;
      if (!facts_.control.status) search.receive_answers(facts_.found, no_later_than(Steady::now() + patience));
      return add_sonar(with_port(given), "");
    }
    if (facts_.control.status)
      for (const v1::SonarStatus& s : facts_.control.status->sonars()) add_sonar({s.advertised(), port_of(s)}, s.name());
    if (facts_.sonars.empty()) {
      status_.listen("", no_later_than(start_ + first_status));
      for (const ReceivedStatus& received : status_.facts().received) add_sonar({received.advertised, usual_port}, "");
      search.receive_answers(facts_.found, Steady::now());
      for (const FoundSonar& found : facts_.found) add_sonar(*parse_endpoint(found.at, {}), "");
    }
    if (facts_.sonars.empty()) add_daemons_sonars(given.host);
    if (facts_.sonars.empty()) add_sonar(with_port(given), "");
  }

  /// Adds the sonars that a sonard of this computer serves without a control stream, such as a recording. `usual`: the address
  /// to examine if that sonard listens at every address.
  void add_daemons_sonars(const std::string& usual) {
    for (const PortHolder& daemon : facts_.daemons) {
      auto at = parse_endpoint(daemon.at, {});
      const Make* const make = at ? make_at(at->port) : nullptr;
      if (make == nullptr || make->ports.front().number != at->port) continue;
      if (at->host == "0.0.0.0") at->host = usual;
      add_sonar(*at, "");
    }
  }

  static std::uint16_t port_of(const v1::SonarStatus& s) {
    const std::uint16_t usual = make_of(s).ports.front().number;
    return parse_endpoint(s.listens(), {"", usual}).value_or(Endpoint{"", usual}).port;
  }
  static const Make& make_of(const v1::SonarStatus& s) { return protocol::make_of_profile(s.profile()); }
  static bool is_at(const v1::SonarStatus& s, const std::string& host) {
    return s.advertised() == host || s.listens().starts_with(host + ":");
  }

  /// Adds the port of the sonar known at this address if `given` has none.
  Endpoint with_port(const Endpoint& given) const {
    if (given.port != 0) return given;
    if (facts_.control.status)
      for (const v1::SonarStatus& s : facts_.control.status->sonars())
        if (is_at(s, given.host)) return {given.host, port_of(s)};
    for (const FoundSonar& found : facts_.found)
      if (found.at.starts_with(given.host + ":")) return *parse_endpoint(found.at, {});
    return {given.host, usual_port};
  }
  const Make& make_of(const Endpoint& at) const {
    if (facts_.control.status)
      for (const v1::SonarStatus& s : facts_.control.status->sonars())
        if (is_at(s, at.host) && port_of(s) == at.port) return make_of(s);
    for (const FoundSonar& found : facts_.found)
      if (found.at == text_from(at)) return *found.make;
    const Make* const found = make_at(at.port);
    return found != nullptr ? *found : protocol::makes().front();
  }

  void add_sonar(const Endpoint& at, const std::string& name) {
    SonarFacts sonar;
    sonar.at = at;
    sonar.make = &make_of(at);
    sonar.name = name;
    facts_.sonars.push_back(std::move(sonar));
  }

  /// Returns null if the daemon serves no sonar there.
  static std::shared_ptr<const v1::SonarStatus> reported_by(const SonarFacts& sonar,
                                                            const std::shared_ptr<const v1::DaemonStatus>& status) {
    for (const v1::SonarStatus& s : status->sonars())
      if (is_at(s, sonar.at.host) && port_of(s) == sonar.at.port) return {status, &s};
    return nullptr;
  }

  void note_clients(SonarFacts& sonar, const std::vector<SocketLine>& sockets) {
    if (facts_.control.status) sonar.reported = reported_by(sonar, facts_.control.status);
    if (sonar.reported) {
      if (sonar.name.empty()) sonar.name = sonar.reported->name();
      for (const v1::ClientStatus& client : sonar.reported->clients()) sonar.clients.push_back(client.address());
      return;
    }
    // Without a daemon, clients are the connections in this computer's kernel, else the client that the status message names.
    for (const SocketLine& socket : sockets)
      if (socket.state == established && socket.local_port == sonar.at.port && socket.local_host == sonar.at.host)
        sonar.clients.push_back(socket.remote_host + ":" + std::to_string(socket.remote_port));
    if (!sonar.clients.empty() || !sends_status(sonar, status_.facts())) return;
    status_.listen(sonar.at.host, no_later_than(start_ + first_status));
    for (const ReceivedStatus& received : status_.facts().received)
      if (!received.client.empty() && (received.advertised == sonar.at.host || received.from == sonar.at.host))
        sonar.clients.push_back(received.client);
  }

  void examine(SonarFacts& sonar, const std::vector<SocketLine>& sockets, const std::vector<SocketLine>& by_udp,
               const std::map<std::uint64_t, Program>& programs) {
    const auto ip = ipv4_of(sonar.at.host);
    if (!ip) {
      sonar.unresolved = ip.error().text;
      return;
    }
    sonar.at.host = *ip;
    sonar.on_this_host = is_on_this_host(*ip);
    sonar.in_our_network = is_in_our_network(*ip);
    for (const SocketLine& socket : sonar.make->is_by_udp() ? by_udp : sockets) {
      const bool here = socket.local_host == *ip || socket.local_host == "0.0.0.0" || socket.local_host == "[::]";
      const bool waits = socket.state == listening || sonar.make->is_by_udp();
      if (sonar.on_this_host && here && waits && socket.local_port == sonar.at.port)
        sonar.listeners.push_back(holder_of(socket, programs));
    }
    if (left_until(deadline_) < 500ms) {
      sonar.out_of_time = true;
      return;
    }
    note_clients(sonar, sockets);
    if (!is_by_http(sonar) && (sonar.clients.empty() || questions_.take))
      watch_pings(sonar, control_ ? &*control_ : nullptr, deadline_, facts_.control);
    update_stats(sonar);
  }

  /// Updates the status of the daemon, which then includes the pings just received.
  void update_stats(SonarFacts& sonar) {
    if (!control_) return;
    const auto status = control_->status(until(short_patience));
    if (!status) return;
    if (auto reported = reported_by(sonar, *status)) sonar.reported = std::move(reported);
    facts_.control.latest = *status;
  }

  void listen_to_all() {
    for (const SonarFacts& sonar : facts_.sonars)  // the other sonars send no such message
      if (sends_status(sonar, status_.facts())) status_.listen(sonar.at.host, no_later_than(start_ + status_patience));
    status_.finish();
    facts_.status = status_.facts();
  }

  const Questions& questions_;
  Steady::time_point start_ = Steady::now(), deadline_;
  StatusListener status_;
  std::optional<ControlClient> control_;
  Facts facts_;
};

}  // namespace

Result<Facts> gather(const Questions& questions) { return Gathering(questions).run(); }

}  // namespace sonar::clients::doctor
