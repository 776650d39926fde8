#include "daemon/commands/replay/replay_command.hpp"

#include <CLI/CLI.hpp>
#include <csignal>
#include <optional>

#include "core/text/arguments.hpp"
#include "core/text/decimal.hpp"
#include "core/text/format.hpp"
#include "daemon/commands/replay/replay_server.hpp"
#include "daemon/commands/replay/requested_replay.hpp"

namespace sonar {

void add_replay_options(CLI::App& app, ReplayCommand& replay) {
  app.footer(
      "examples:\n"
      "  sonard replay run.pcap                            at 127.0.0.2, at the pace it was recorded with\n"
      "  sonard replay capture.pcapng --speed 4 --loop\n"
      "  sonard replay run.mcap --stepped                  as fast as the driver reads\n"
      "Ends when a driver has received the whole recording; with --loop, and if it is a mechanical scan, by Ctrl-C.");
  app.add_option("file", replay.file, "recording: pcapng, " + recording::file_endings())->required();
  app.add_option("--ip", replay.ip, "address to serve it at, one of this computer's")->capture_default_str();
  app.add_option("--port", replay.port, "TCP port (default: the sonar's)")->check(text::whole_number(1, 65535));
  app.add_option("--status-to", replay.status_to,
                 "IP or IP:PORT for status datagrams (default: broadcast of the address's network)");
  CLI::Option* speed = app.add_option("--speed", replay.speed, "2 = twice as fast as recorded")
                           ->check(text::number(0.001, 1000))
                           ->capture_default_str();
  app.add_flag("--stepped", replay.stepped, "no pace: send the next message when the driver has received the last one")
      ->excludes(speed);
  app.add_flag("--loop", replay.loop, "repeat the recording without end");
  app.add_option("--rate", replay.rate_hz, "messages a second of raw dumps, which have no times")
      ->check(text::number(0.001, 10000))
      ->capture_default_str();
  app.add_option("--sonar", replay.sonar, "the sonar, if the file has several: its address in captures, its name in MCAP");
  app.add_option("--part-number", replay.part_number,
                 "part number of the sonar, if the recording holds no status (1042 = M1200d)")
      ->check(text::whole_number(1, 65535))
      ->capture_default_str();
  app.add_option("--http", replay.http, "IP:PORT of the page that shows the recording, or off")->capture_default_str();
  app.add_option("--log-format", "text or json (default text)")
      ->check(text::one_of({"text", "json"}))
      ->each([&replay](const std::string& format) { replay.json = format == "json"; });
}

namespace {

/// Parses IP or IP:PORT; the port is 0 if none is given.
Result<Endpoint> endpoint_from(const std::string& place, const std::string& option) {
  const std::size_t colon = place.find(':');
  const auto ip = parse_ipv4(place.substr(0, colon));
  if (!ip) return failure(ErrorKind::usage, option + ": " + ip.error().text);
  if (colon == std::string::npos) return Endpoint{*ip, 0};
  const auto port = text::parse_integer(std::string_view(place).substr(colon + 1));
  if (!port || *port < 0 || *port > 65535)
    return failure(ErrorKind::usage, option + ": \"" + place + "\": the port is not a number from 0 to 65535");
  return Endpoint{*ip, static_cast<std::uint16_t>(*port)};
}

/// Like endpoint_from(), for an address of this computer.
Result<Endpoint> listener_from(const std::string& place, const std::string& option) {
  const auto at = endpoint_from(place, option);
  const std::string why = at ? why_not_of_a_computer(at->ip) : "";
  return why.empty() ? at : failure(ErrorKind::usage, option + ": " + why);
}

/// Returns the line of the banner; empty if the page is off, or if its address is in use and `must_open` is false.
Result<std::string> open_page(ReplayPage& page, const std::optional<Endpoint>& at, bool must_open, Log& log) {
  if (!at) return std::string();
  if (const auto opened = page.open(*at); !opened) {
    const std::string what = opened.error().text + "; --http can set another address, or off";
    if (must_open) return failure(opened.error().kind, what);
    log.warning("continuing without the page: " + what);
    return std::string();
  }
  page.start();
  return "open      http://" + text_of(page.at()) + "   the recording, in a browser\n";
}

/// Returns the address of the page; nullopt if the page is off.
Result<std::optional<Endpoint>> page_from(const ReplayCommand& command) {
  if (command.http == "off") return std::optional<Endpoint>();
  const auto at = listener_from(command.http, "--http");
  if (!at) return tl::make_unexpected(at.error());
  return std::optional(*at);
}

Result<ReplayOptions> options_from(const ReplayCommand& command) {
  ReplayOptions options;
  const auto usage = [](const Error& error) { return failure(ErrorKind::usage, error.text); };
  const auto ip = parse_ipv4(command.ip);
  if (!ip) return usage(ip.error());
  if (const std::string why = why_not_of_a_computer(*ip); !why.empty()) return failure(ErrorKind::usage, "--ip: " + why);
  options.at = {*ip, command.port};
  for (const std::string& place : command.status_to) {
    const auto to = endpoint_from(place, "--status-to");
    if (!to) return tl::make_unexpected(to.error());
    options.status_to.push_back(*to);
  }
  options.speed = command.speed;
  options.stepped = command.stepped;
  options.loop = command.loop;
  options.rate_hz = command.rate_hz;
  options.handle_signals = true;
  return options;
}

}  // namespace

Result<void> run_replay(const ReplayCommand& command) {
  std::signal(SIGPIPE, SIG_IGN);
  auto options = options_from(command);
  if (!options) return tl::make_unexpected(options.error());
  const auto page_at = page_from(command);
  if (!page_at) return tl::make_unexpected(page_at.error());
  auto opened = recording::open_recording(std::filesystem::path(command.file), command.sonar);
  if (!opened) return tl::make_unexpected(opened.error());
  auto device = find_replay_device(*opened->reader, command.file, command.part_number);
  if (!device) return tl::make_unexpected(device.error());
  if (device->by_requests() && (command.stepped || command.port != 0))
    return failure(ErrorKind::usage,
                   std::string(command.stepped ? "leave out --stepped: the driver's requests and --speed set the pace of "
                                               : "leave out --port: drivers always use the same ports of ") +
                       std::string(device->make->title));
  if (device->by_datagrams() && command.stepped)
    return failure(ErrorKind::usage, "leave out --stepped: no driver confirms datagrams; --speed sets their pace");
  if (command.port == 0 && !device->by_requests()) options->at.port = device->tcp_port();
  LogOptions log_options;
  log_options.json = command.json;
  Log log(log_options);
  asio::io_context io;
  const LimitConfig limits;
  Admission admission(limits, log);
  ReplayPage page(io, limits, admission, log, {command.file, command.sonar, command.rate_hz});
  // The page keeps the event loop running, so the end of the replay stops the page.
  options->on_end = [&page] { page.stop(); };
  const auto serve = [&](auto& server, const std::string& place) -> Result<void> {
    if (!opened->reader->note().empty()) log.info(opened->reader->note());
    const auto where = open_page(page, *page_at, command.http != ReplayCommand::default_page, log);
    if (!where) return tl::make_unexpected(where.error());
    if (!device->is_only_seen.empty() && where->empty()) return failure(ErrorKind::bad_data, device->is_only_seen);
    if (!device->is_only_seen.empty())
      log.announce(device->is_only_seen + "; Ctrl-C stops\n");
    else
      log.announce(std::string("replaying ") + command.file + " (" + std::string(opened->format) + ") as " + device->name() +
                   " on " + place + "; Ctrl-C stops\n");
    log.announce(*where);
    server.start();
    io.run();
    if (!device->is_only_seen.empty()) return server.outcome();
    const ReplayServer::Figures done = server.figures();
    log.announce("served " + std::to_string(done.messages) + " messages, " + std::to_string(done.bytes) + " bytes, to " +
                 text::counted(done.clients, "client") + "\n");
    return server.outcome();
  };
  // The ports of the sonar are opened first. If one is in use, the command ends; if the page cannot open, it continues.
  if (device->by_requests()) {
    RequestedReplay server(io, *opened->reader, *device, *options, log);
    if (auto listening = server.open(command.file); !listening) return listening;
    return serve(server, server.at());
  }
  ReplayServer server(io, *opened->reader, *device, *options, log);
  if (auto listening = server.open(); !listening) return listening;
  return serve(server, "tcp " + text_of(server.at()));
}

}  // namespace sonar
