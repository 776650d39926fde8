// Command line of record.
#include <CLI/CLI.hpp>
#include <memory>

#include "clients/sonarctl/command_line.hpp"
#include "clients/sonarctl/record.hpp"
#include "clients/sonarctl/setting_options.hpp"
#include "core/text/arguments.hpp"

namespace sonar::clients {

Run add_record(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("record", "record a sonar's bytes as its client, or convert a recording");
  command.footer(
      "examples:\n"
      "  sonarctl record --pcap run.pcap --mcap run.mcap --seconds 60\n"
      "  sonarctl record 192.168.2.42 --mcap run.mcap               until Ctrl-C\n"
      "  sonarctl record --from capture.pcapng --mcap run.mcap\n"
      "`sonarctl view --from FILE` shows any of these files, `sonard replay FILE` serves them to a driver");
  struct Arguments {
    RecordOptions options;
    SourceArguments source;
    bool no_status = false;
  };
  const auto arguments = std::make_shared<Arguments>();
  RecordOptions& options = arguments->options;
  arguments->source.add_to(command, true, "reports the address for observers, and the poses for the MCAP file");
  command.add_option("--pcap", options.pcap, "capture for Wireshark: both directions and the status datagrams");
  command.add_option("--mcap", options.mcap, "the same for Foxglove and others, with each ping as an image");
  for (const Make& make : protocol::makes())
    for (const recording::FileKind& kind : make.codec.files) {
      if (options.files.contains(kind.ending)) continue;
      std::string name = "--" + std::string(kind.ending.substr(1));
      if (command.get_option_no_throw(name) != nullptr) name += "-file";
      command.add_option(name, options.files[kind.ending], "the makers' own kind of file, with " + std::string(kind.holds));
    }
  command.add_option("--raw", options.raw, "only the bytes of the sonar");
  command.add_option("--seconds", options.seconds, "stop after this time")->check(text::number(0));
  command.add_option("--pings", options.pings, "stop after this number of pings")->check(text::whole_number());
  command.add_option("--status-on", options.status_on, "address for status messages (default 0.0.0.0, the port of the make)")
      ->check(address());
  command.add_flag("--no-status", arguments->no_status, "do not record status messages");
  return [arguments]() -> Result<void> {
    RecordOptions chosen = arguments->options;
    auto source = arguments->source.finish();
    if (!source) return tl::unexpected(source.error());
    chosen.source = std::move(*source);
    std::erase_if(chosen.files, [](const auto& file) { return file.second.empty(); });
    chosen.status = !arguments->no_status;
    if (!chosen.source.control.empty()) chosen.control = ControlOptions{chosen.source.control, chosen.source.token_file};
    return record(chosen);
  };
}

}  // namespace sonar::clients
