// Command lines of listen, view and stats, which examine pings.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "clients/sonarctl/argument_checks.hpp"
#include "clients/sonarctl/command_line.hpp"
#include "clients/sonarctl/commands.hpp"
#include "clients/sonarctl/fire_options.hpp"
#include "core/text/arguments.hpp"

namespace sonar::clients {
namespace {

using text::number;
using text::whole_number;

/// Options that belong to a source of pings; finish() turns their texts into a SourceOptions once the line is parsed.
struct SourceArguments {
  DeviceArguments device;
  bool as_it_is = false, observe = false, is_blueview = false, is_aris = false, is_3d15 = false;
  std::string control;
  std::filesystem::path token_file;
  std::string recording;
  FireArguments fire;

  void add_to(CLI::App& app, bool recordings) {
    device.add_to(app,
                  "port of the sonar (default: 52100 of an Oculus, 14750 of a BlueView head, 56888 of an ARIS, 62312 of a "
                  "Surveyor, 51200 of an Omniscan, 12345 of a Ping360 or 80 of a Sonar 3D-15, the first that answers)");
    app.add_flag("--blueview", is_blueview, "the sonar is a BlueView head; needed on ports other than 14750");
    app.add_flag("--aris", is_aris, "the sonar is an ARIS; needed on ports other than 56888");
    app.add_flag("--3d15", is_3d15, "the sonar is a Sonar 3D-15; needed on ports other than 80");
    if (recordings) app.add_option("--from-raw", recording, "read a recording of the raw TCP bytes instead of a device");
    app.add_flag("--as-it-is", as_it_is, "send no settings (many sonars then send no pings)");
    app.add_flag("--observe", observe,
                 "receive the pings that clients request, without occupying a client slot or sending settings");
    app.add_option("--control", control, "HOST:PORT of sonard's control stream, which reports the address for observers")
        ->check(clients::address());
    app.add_option("--token-file", token_file, "the daemon's control.token_file, if it has one");
    fire.add_to(app);
  }

  Result<SourceOptions> finish() const {
    SourceOptions source;
    Result<Endpoint> at = parse_endpoint(device.address, {"127.0.0.2", device.port});
    if (!at) return tl::unexpected(at.error());
    if (device.discover && is_blueview)
      return failure(ErrorKind::usage,
                     "--discover finds Oculus sonars only: leave it out, and give the address of the BlueView head");
    const bool any_port = at->port == 0;
    if (any_port)
      at->port = is_blueview ? blueview::tcp_port : is_aris ? aris::command_port : is_3d15 ? waterlinked_port : oculus::tcp_port;
    source.kind = SonarKind::oculus;
    if (is_blueview || at->port == blueview::tcp_port)
      source.kind = SonarKind::blueview;
    else if (is_aris || at->port == aris::command_port)
      source.kind = SonarKind::aris;
    else if (is_3d15 || at->port == waterlinked_port)
      source.kind = SonarKind::waterlinked;
    else if (brping_device_at(at->port))
      source.kind = SonarKind::brping;
    else if (any_port && !device.discover)
      source.kind = SonarKind::either;
    source.device = *at;
    source.discover = device.discover;
    source.recording = recording;
    source.connect_patience_s = device.patience_s;
    source.silence_limit_s = std::max(source.silence_limit_s, device.patience_s);
    source.observe = observe;
    source.control = control;
    source.token_file = token_file;
    if (!as_it_is && recording.empty()) source.asked = fire.request();
    if (!as_it_is) source.head = fire.head_request();
    return source;
  }
};

struct StyleArguments {
  std::string colour_map = "copper";
  int width_px = 1000;
  bool no_rings = false;

  void add_to(CLI::App& app) {
    app.add_option("--colour-map", colour_map, "one of " + colour_map_names())
        ->check(clients::colour_map())
        ->capture_default_str();
    app.add_option("--width", width_px, "of the picture, in pixels")->check(whole_number(1, 100000))->capture_default_str();
    app.add_flag("--no-rings", no_rings, "draw no range rings");
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
      "  sonarctl listen 127.0.0.3 --range 20          detects a BlueView head at that address\n"
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
    listen_options.triggered = arguments->source.fire.triggered();
    return listen(listen_options);
  };
}

Run add_view(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("view", "draw pings as fans: into a file or the terminal, once or live");
  command.footer(
      "examples:\n"
      "  sonarctl view --png ping.png\n"
      "  sonarctl view --term --live                  in the terminal until Ctrl-C\n"
      "  sonarctl view --png ping.png --live          the file is replaced with every ping\n"
      "  sonarctl view --from-raw recording.raw --ping 2 --png ping.png --colour-map gray --width 1600");
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
  command.add_option("--ping", options.ping, "which ping of a recording, from 0")->check(whole_number())->capture_default_str();
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
      "  sonarctl stats --from-raw recording.raw --rows 400:650 --json\n"
      "  sonarctl stats --rows 150:300,0:200 --shadow 220:260,240:270 --surroundings 220:260,300:400");
  struct Arguments {
    StatsOptions options;
    SourceArguments source;
  };
  const auto arguments = std::make_shared<Arguments>();
  StatsOptions& options = arguments->options;
  arguments->source.add_to(command, true);
  command.add_option("--ping", options.ping, "which ping of a recording, from 0")->check(whole_number())->capture_default_str();
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

}  // namespace sonar::clients
