// record on the command line.
#include <CLI/CLI.hpp>
#include <memory>

#include "clients/sonarctl/argument_checks.hpp"
#include "clients/sonarctl/command_line.hpp"
#include "clients/sonarctl/fire_options.hpp"
#include "clients/sonarctl/record.hpp"
#include "core/text/arguments.hpp"

namespace sonar::clients {

Run add_record(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("record", "record a sonar's bytes as its client, or turn one recording into another");
  command.footer(
      "examples:\n"
      "  sonarctl record --pcap run.pcap --mcap run.mcap --seconds 60\n"
      "  sonarctl record 192.168.2.42 --oculus run.oculus          until Ctrl-C\n"
      "  sonarctl record --from capture.pcapng --oculus run.oculus\n"
      "`sonard replay FILE` serves any of these files to a driver");
  struct Arguments {
    RecordOptions options;
    std::string address, control, status_on;
    std::uint16_t port = 52100;
    bool as_it_is = false, no_status = false;
    FireArguments fire;
  };
  const auto arguments = std::make_shared<Arguments>();
  RecordOptions& options = arguments->options;
  command.add_option("ADDRESS", arguments->address, "address of the sonar, HOST or HOST:PORT (default 127.0.0.2)")
      ->check(address());
  command.add_option("--port", arguments->port, "TCP port of the sonar")
      ->check(text::whole_number(1, 65535))
      ->capture_default_str();
  command.add_flag("--discover", options.source.discover, "take the address from the status broadcast on udp 52102");
  command.add_option("--wait", options.source.connect_patience_s, "seconds to go on trying to connect")
      ->check(text::number(0))
      ->capture_default_str();
  command.add_option("--pcap", options.pcap, "capture for Wireshark: both directions and the status datagrams");
  command.add_option("--mcap", options.mcap, "the same for Foxglove and others, with each ping as a picture");
  command.add_option("--oculus", options.oculus, "log file of the vendor's kind, version 1");
  command.add_option("--raw", options.raw, "the bytes of the sonar, nothing else");
  command.add_option("--seconds", options.seconds, "stop after this time")->check(text::number(0));
  command.add_option("--pings", options.pings, "stop after so many pings")->check(text::whole_number());
  command.add_option("--status-on", arguments->status_on, "where to listen for status messages (default 0.0.0.0:52102)")
      ->check(address());
  command.add_flag("--no-status", arguments->no_status, "do not listen for them");
  CLI::Option* control = command.add_option("--control", arguments->control,
                                            "HOST:PORT of the sonard's control stream: its poses go into the MCAP file");
  command.add_option("--token-file", options.control.emplace().token_file, "the daemon's secret, when it wants one")
      ->needs(control);
  CLI::Option* from =
      command.add_option("--from", options.source.recording, "read this recording instead of a sonar")->excludes(control);
  command.add_option("--sonar", options.sonar, "with --from: which of several, its address in captures, its name in MCAP")
      ->needs(from);
  command.add_flag("--as-it-is", arguments->as_it_is, "send no settings, only record (many sonars then send no pings)");
  arguments->fire.add_to(command);
  return [arguments]() -> Result<void> {
    RecordOptions wish = arguments->options;
    const Result<Endpoint> device = parse_endpoint(arguments->address, {"127.0.0.2", arguments->port});
    if (!device) return tl::unexpected(device.error());
    wish.source.device = *device;
    const Result<Endpoint> status_on = parse_endpoint(arguments->status_on, wish.status_on);
    if (!status_on) return tl::unexpected(status_on.error());
    wish.status_on = *status_on;
    if (!arguments->as_it_is) wish.source.asked = arguments->fire.request();
    wish.triggered = arguments->fire.triggered();
    wish.status = !arguments->no_status;
    wish.control->address = arguments->control;
    if (arguments->control.empty()) wish.control.reset();
    return record(wish);
  };
}

}  // namespace sonar::clients
