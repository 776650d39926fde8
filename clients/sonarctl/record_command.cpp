// Command line of record.
#include <CLI/CLI.hpp>
#include <memory>

#include "clients/sonarctl/argument_checks.hpp"
#include "clients/sonarctl/command_line.hpp"
#include "clients/sonarctl/record.hpp"
#include "clients/sonarctl/setting_options.hpp"
#include "core/text/arguments.hpp"
#include "protocol/oculus/messages.hpp"

namespace sonar::clients {

Run add_record(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("record", "record a sonar's bytes as its client, or convert a recording");
  command.footer(
      "examples:\n"
      "  sonarctl record --pcap run.pcap --mcap run.mcap --seconds 60\n"
      "  sonarctl record 192.168.2.42 --oculus run.oculus          until Ctrl-C\n"
      "  sonarctl record --from capture.pcapng --oculus run.oculus\n"
      "`sonard replay FILE` serves any of these files to a driver");
  struct Arguments {
    RecordOptions options;
    DeviceArguments device;
    std::string control, status_on;
    bool as_it_is = false, no_status = false;
    SettingArguments settings;
  };
  const auto arguments = std::make_shared<Arguments>();
  RecordOptions& options = arguments->options;
  arguments->device.port = oculus::tcp_port;
  arguments->device.add_to(command, "TCP port of the sonar (default 52100)");
  command.add_option("--pcap", options.pcap, "capture for Wireshark: both directions and the status datagrams");
  command.add_option("--mcap", options.mcap, "the same for Foxglove and others, with each ping as an image");
  command.add_option("--oculus", options.oculus, "log file in the vendor's format, version 1");
  command.add_option("--raw", options.raw, "only the bytes of the sonar");
  command.add_option("--seconds", options.seconds, "stop after this time")->check(text::number(0));
  command.add_option("--pings", options.pings, "stop after this number of pings")->check(text::whole_number());
  command.add_option("--status-on", arguments->status_on, "address for status messages (default 0.0.0.0:52102)")
      ->check(address());
  command.add_flag("--no-status", arguments->no_status, "do not record status messages");
  CLI::Option* control = command.add_option("--control", arguments->control,
                                            "HOST:PORT of sonard's control stream; adds its poses to the MCAP file");
  command.add_option("--token-file", options.control.emplace().token_file, "the daemon's control.token_file, if it has one")
      ->needs(control);
  CLI::Option* from =
      command.add_option("--from", options.source.recording, "read this recording instead of a sonar")->excludes(control);
  command.add_option("--sonar", options.sonar, "with --from: selects one of several: by address in captures, by name in MCAP")
      ->needs(from);
  command.add_flag("--as-it-is", arguments->as_it_is, "send no settings (many sonars then send no pings)");
  arguments->settings.add_to(command);
  return [arguments]() -> Result<void> {
    RecordOptions chosen = arguments->options;
    const Result<Endpoint> device = parse_endpoint(arguments->device.address, {"127.0.0.2", arguments->device.port});
    if (!device) return tl::unexpected(device.error());
    chosen.source.device = *device;
    chosen.source.discover = arguments->device.discover;
    chosen.source.connect_patience_s = arguments->device.patience_s;
    const Result<Endpoint> status_on = parse_endpoint(arguments->status_on, chosen.status_on);
    if (!status_on) return tl::unexpected(status_on.error());
    chosen.status_on = *status_on;
    chosen.source.wanted = arguments->settings.wanted();
    chosen.source.wanted.as_it_is = arguments->as_it_is;
    chosen.status = !arguments->no_status;
    chosen.control->address = arguments->control;
    if (arguments->control.empty()) chosen.control.reset();
    return record(chosen);
  };
}

}  // namespace sonar::clients
