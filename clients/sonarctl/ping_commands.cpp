// Command lines of listen, view and stats, which examine pings.

#include <memory>

#include <CLI/CLI.hpp>

#include "clients/sonarctl/command_line.hpp"
#include "clients/sonarctl/commands.hpp"
#include "clients/sonarctl/record.hpp"
#include "core/text/arguments.hpp"

namespace sonar::clients {
namespace {

using text::number;
using text::one_of;
using text::whole_number;

struct StyleArguments {
  std::string colour_map = "copper";
  int width_px = 1000;
  bool no_rings = false;

  void add_to(CLI::App& app) {
    app.add_option("--colour-map", colour_map, "one of " + colour_map_names())
        ->check(clients::colour_map())
        ->capture_default_str();
    app.add_option("--width", width_px, "width of the picture, in pixels")->check(whole_number(1, 100000))->capture_default_str();
    app.add_flag("--no-rings", no_rings, "draw no ranges, bearings or times");
  }

  Result<FanStyle> finish() const {
    const Result<ColourMap> map = find_colour_map(colour_map);
    if (!map) return tl::unexpected(map.error());
    return FanStyle{width_px, *map, !no_rings};
  }
};

}  // namespace

Run add_listen(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("listen", "connect as a driver does; print and check every ping");
  command.footer(
      "examples:\n"
      "  sonarctl listen --seconds 60\n"
      "  sonarctl listen 127.0.0.3 --mode 1 --range 30 --beams 512 --pings 100 --quiet\n"
      "  sonarctl listen --discover --json | head\n"
      "exit code 0 only when every ping was valid and the settings were echoed as requested");
  struct Arguments {
    ListenOptions options;
    SourceArguments source;
    StyleArguments style;
  };
  const auto arguments = std::make_shared<Arguments>();
  ListenOptions& options = arguments->options;
  arguments->source.add_to(command, false);
  command.add_option("--seconds", options.seconds, "stop after this time")->check(number(0));
  command.add_option("--pings", options.pings, "stop after this number of pings")->check(whole_number());
  command.add_flag("--json", options.json, "one JSON object per line, the last one a summary");
  command.add_flag("--quiet", options.quiet, "print only invalid pings and the summary");
  command.add_option("--record", options.record, "write the raw TCP bytes to this file");
  command.add_option("--png", options.png, "draw the last ping into this file");
  command.add_option("--started-at", options.started_at_unix_s, "UNIX time from which to count the time to the first ping")
      ->check(number());
  arguments->style.add_to(command);
  return [arguments]() -> Result<void> {
    ListenOptions& listen_options = arguments->options;
    auto source = arguments->source.finish();
    auto style = arguments->style.finish();
    if (!source) return tl::unexpected(source.error());
    if (!style) return tl::unexpected(style.error());
    listen_options.source = std::move(*source);
    listen_options.style = std::move(*style);
    return listen(listen_options);
  };
}

Run add_view(CLI::App& app) {
  CLI::App& command =
      *app.add_subcommand("view", "draw pings like the make's own program: into a file or the terminal, once or live");
  command.footer(
      "examples:\n"
      "  sonarctl view --png ping.png\n"
      "  sonarctl view --term --live                  in the terminal until Ctrl-C\n"
      "  sonarctl view --png ping.png --live          the file is replaced with every ping\n"
      "  sonarctl view --from run.mcap --ping 2 --png ping.png --colour-map gray --width 1600");
  struct Arguments {
    ViewOptions options;
    SourceArguments source;
    StyleArguments style;
    bool ascii = false;
  };
  const auto arguments = std::make_shared<Arguments>();
  ViewOptions& options = arguments->options;
  arguments->source.add_to(command, true);
  command.add_option("--png", options.png, "file to write");
  command.add_flag("--term", options.terminal, "draw in the terminal: half blocks, in colour where it has colours");
  command.add_flag("--ascii", arguments->ascii, "with --term: letters, no colours (default for files, pipes and NO_COLOR)");
  command.add_flag("--live", options.live, "draw every ping, until Ctrl-C");
  command.add_option("--pings", options.pings, "with --live: stop after this number of pings")->check(whole_number());
  command.add_option("--ping", options.ping, "which ping of a recording, from 0 (default: the first that makes a whole picture)")
      ->check(whole_number());
  arguments->style.add_to(command);
  return [arguments]() -> Result<void> {
    auto source = arguments->source.finish();
    auto style = arguments->style.finish();
    if (!source) return tl::unexpected(source.error());
    if (!style) return tl::unexpected(style.error());
    ViewOptions& view_options = arguments->options;
    view_options.source = std::move(*source);
    view_options.style = std::move(*style);
    if (arguments->ascii) view_options.colours = TerminalColours::none;
    return view(view_options);
  };
}

Run add_stats(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("stats", "statistics of one ping's samples: speckle correlation, noise, shadow");
  command.footer(
      "examples:\n"
      "  sonarctl stats --rows 400:650\n"
      "  sonarctl stats --from run.pcap --rows 400:650 --json\n"
      "  sonarctl stats --rows 150:300,0:200 --shadow 220:260,240:270 --surroundings 220:260,300:400");
  struct Arguments {
    StatsOptions options;
    SourceArguments source;
  };
  const auto arguments = std::make_shared<Arguments>();
  StatsOptions& options = arguments->options;
  arguments->source.add_to(command, true);
  command.add_option("--ping", options.ping, "which ping of a recording, from 0 (default: the first that makes a whole picture)")
      ->check(whole_number());
  command.add_option("--rows", options.window, "window of the speckle statistics, ROW:ROW or ROW:ROW,BEAM:BEAM");
  CLI::Option* shadow = command.add_option("--shadow", options.shadow, "window in a shadow");
  command.add_option("--surroundings", options.surroundings, "window beside it")->needs(shadow);
  command.add_flag("--json", options.json, "one JSON object");
  return [arguments]() -> Result<void> {
    auto source = arguments->source.finish();
    if (!source) return tl::unexpected(source.error());
    arguments->options.source = std::move(*source);
    return stats(arguments->options);
  };
}

// Command line of record.

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
    return record(chosen);
  };
}

}  // namespace sonar::clients
