// sonarctl: what a sonar's user has at hand when something is unclear. Command line to options, and errors to exit codes.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <limits>
#include <memory>

#include "clients/sonarctl/commands.hpp"
#include "clients/sonarctl/fire_options.hpp"
#include "clients/sonarctl/scene_command.hpp"

namespace sonar::clients {

namespace {

/// Options that belong to a source of pings; finish() turns their texts into a SourceOptions once the line is parsed.
struct SourceArguments {
  std::string address;
  std::uint16_t port = 52100;
  bool discover = false, as_it_is = false;
  std::string recording;
  double patience_s = 2;
  FireArguments fire;

  void add_to(CLI::App& app, bool recordings) {
    app.add_option("ADDRESS", address, "address of the sonar, HOST or HOST:PORT (default 127.0.0.2)");
    app.add_option("--port", port, "TCP port of the sonar")->capture_default_str();
    app.add_flag("--discover", discover, "take the address from the status broadcast on udp 52102");
    app.add_option("--wait", patience_s, "seconds to go on trying to connect")->capture_default_str();
    if (recordings) app.add_option("--from-raw", recording, "read a recording of the raw TCP bytes instead of a device");
    app.add_flag("--as-it-is", as_it_is, "send no settings, only look (many sonars then send no pings)");
    fire.add_to(app);
  }

  Result<SourceOptions> finish() const {
    SourceOptions source;
    const Result<Endpoint> device = parse_endpoint(address, {"127.0.0.2", port});
    if (!device) return tl::unexpected(device.error());
    source.device = *device;
    source.discover = discover;
    source.recording = recording;
    source.connect_patience_s = patience_s;
    if (!as_it_is && recording.empty()) source.asked = fire.request();
    return source;
  }
};

struct StyleArguments {
  std::string colour_map = "copper";
  int width_px = 1000;
  bool no_rings = false;

  void add_to(CLI::App& app) {
    app.add_option("--colour-map", colour_map, "one of " + colour_map_names())->capture_default_str();
    app.add_option("--width", width_px, "of the picture, in pixels")->capture_default_str();
    app.add_flag("--no-rings", no_rings, "draw no range rings");
  }

  Result<FanStyle> finish() const {
    const Result<ColourMap> map = find_colour_map(colour_map);
    if (!map) return tl::unexpected(map.error());
    return FanStyle{width_px, *map, !no_rings};
  }
};

using Run = std::function<Result<void>()>;

Run add_listen(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("listen", "connect as a driver does; print and check every ping");
  command.footer(
      "examples:\n"
      "  sonarctl listen --seconds 60\n"
      "  sonarctl listen 127.0.0.3 --mode 1 --range 30 --beams 512 --pings 100 --quiet\n"
      "  sonarctl listen --discover --json | head\n"
      "exit code 0 only when every ping was sound and the settings were echoed as asked");
  struct Arguments {
    ListenOptions options;
    SourceArguments source;
    StyleArguments style;
  };
  const auto arguments = std::make_shared<Arguments>();
  ListenOptions& options = arguments->options;
  arguments->source.add_to(command, false);
  command.add_option("--seconds", options.seconds, "stop after this time");
  command.add_option("--pings", options.pings, "stop after so many pings");
  command.add_flag("--json", options.json, "one JSON object a line, the last one a summary");
  command.add_flag("--quiet", options.quiet, "only broken pings and the summary");
  command.add_option("--record", options.record, "write the raw TCP bytes to this file");
  command.add_option("--png", options.png, "draw the last ping into this file");
  command.add_option("--started-at", options.started_at_unix_s, "UNIX time from which to count the time to the first ping");
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
  CLI::App& command = *app.add_subcommand("view", "draw one ping as a fan");
  command.footer(
      "examples:\n"
      "  sonarctl view --png ping.png\n"
      "  sonarctl view --from-raw recording.raw --ping 2 --png ping.png --colour-map gray --width 1600");
  struct Arguments {
    ViewOptions options;
    SourceArguments source;
    StyleArguments style;
  };
  const auto arguments = std::make_shared<Arguments>();
  arguments->source.add_to(command, true);
  command.add_option("--png", arguments->options.png, "file to write")->required();
  command.add_option("--ping", arguments->options.ping, "which ping of a recording, from 0")->capture_default_str();
  arguments->style.add_to(command);
  return [arguments]() -> Result<void> {
    auto source = arguments->source.finish();
    auto style = arguments->style.finish();
    if (!source) return tl::unexpected(source.error());
    if (!style) return tl::unexpected(style.error());
    arguments->options.source = std::move(*source);
    arguments->options.style = std::move(*style);
    return view(arguments->options);
  };
}

Run add_stats(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("stats", "figures of one ping's samples: speckle correlation, noise, shadow");
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
  command.add_option("--ping", options.ping, "which ping of a recording, from 0")->capture_default_str();
  command.add_option("--rows", options.window, "window of the speckle figures, ROW:ROW or ROW:ROW,BEAM:BEAM");
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

void add_pose_options(CLI::App& command, PoseOptions& options) {
  command.add_option("--to", options.to, "HOST:PORT of sonard (default 127.0.0.1:14770, with --json :14771)");
  command.add_flag("--json", options.json, "send JSON lines with ArduPilot's keys, not protobuf");
  command.add_flag("--confirm", options.confirm, "use the TCP control stream and have each pose answered");
  const std::map<std::string, control::Frame> frames{{"enu", control::Frame::enu_flu}, {"ned", control::Frame::ned_frd}};
  command.add_option("--frame", options.frame, "of the arguments and of what is sent: enu (FLU body) or ned (FRD body)")
      ->transform(CLI::CheckedTransformer(frames, CLI::ignore_case));
  command.add_option("--vehicle", options.vehicle, "name of the vehicle, if there are several");
  command.add_option("--object", options.object, "move an object of the scene instead");
  command.add_option("--rate", options.rate_hz, "poses a second")->check(CLI::Range(0.001, 1000.0))->capture_default_str();
  command.add_option("--seconds", options.seconds, "how long; 0 = once, one turn, one line")->check(CLI::NonNegativeNumber);
}

void add_triple(CLI::App& command, const std::string& name, std::vector<double>& value, const std::string& help) {
  command.add_option(name, value, help)->expected(3)->delimiter(',')->check(CLI::Range(-1e7, 1e7))->capture_default_str();
}

Run add_pose(CLI::App& app) {
  CLI::App& pose = *app.add_subcommand("pose", "tell sonard where a vehicle or an object is");
  pose.require_subcommand(1);
  pose.footer(
      "examples:\n"
      "  sonarctl pose once --xyz 0,0,-3 --rpy 0,10,90\n"
      "  sonarctl pose once --frame ned --xyz 0,0,3 --json\n"
      "  sonarctl pose circle --centre 0,0,-3 --radius 6 --period 40 --pitch -15\n"
      "  sonarctl pose line --from 0,-8,-4 --to-point 0,8,-4 --speed 0.5 --object diver");
  const auto options = std::make_shared<PoseOptions>();

  CLI::App& once = *pose.add_subcommand("once", "one place; repeated with --seconds");
  add_triple(once, "--xyz", options->position_m, "position, m");
  add_triple(once, "--rpy", options->rpy_deg, "roll, pitch, yaw in degrees, intrinsic Z-Y-X");
  once.callback([options] { options->path = PoseOptions::Path::once; });

  CLI::App& circle = *pose.add_subcommand("circle", "round a centre, looking at it");
  add_triple(circle, "--centre", options->centre_m, "m");
  circle.add_option("--radius", options->radius_m, "m")->check(CLI::Range(0.0, 1e6))->capture_default_str();
  circle.add_option("--period", options->period_s, "seconds a turn; negative = clockwise")->capture_default_str();
  circle.add_option("--pitch", options->pitch_deg, "degrees, bow up positive")->check(CLI::Range(-90.0, 90.0));
  circle.add_flag("!--look-ahead", options->look_inwards, "look along the path");
  circle.callback([options] { options->path = PoseOptions::Path::circle; });

  CLI::App& line = *pose.add_subcommand("line", "from a point to another, looking ahead");
  add_triple(line, "--from", options->from_m, "m");
  add_triple(line, "--to-point", options->to_m, "m");
  line.add_option("--speed", options->speed_mps, "m/s")->check(CLI::Range(1e-3, 1e3))->capture_default_str();
  line.add_option("--pitch", options->pitch_deg, "degrees, bow up positive")->check(CLI::Range(-90.0, 90.0));
  line.callback([options] { options->path = PoseOptions::Path::line; });

  for (CLI::App* command : {&once, &circle, &line}) add_pose_options(*command, *options);
  return [options]() -> Result<void> {
    if (options->path == PoseOptions::Path::circle && std::abs(options->period_s) < 0.01)
      return failure(ErrorKind::usage, "--period must be at least 0.01 s either way");
    return send_poses(*options);
  };
}

int run(int argc, char** argv) {
  CLI::App app("sonarctl: listen to, look at and steer sonars served by sonard");
  app.require_subcommand(1);
  app.footer("sonarctl COMMAND --help explains a command, with examples");
  const std::vector<std::pair<std::string, Run>> commands{{"listen", add_listen(app)},
                                                          {"view", add_view(app)},
                                                          {"stats", add_stats(app)},
                                                          {"pose", add_pose(app)},
                                                          {"scene", add_scene(app)}};
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : exit_code(ErrorKind::usage);
  }
  for (const auto& [name, command] : commands) {
    if (!app.got_subcommand(name)) continue;
    const Result<void> done = command();
    std::fflush(stdout);
    if (done) return 0;
    std::fprintf(stderr, "sonarctl: %s\n", done.error().text.c_str());
    return exit_code(done.error().kind);
  }
  return exit_code(ErrorKind::bug);
}

}  // namespace
}  // namespace sonar::clients

int main(int argc, char** argv) {
  struct sigaction on_interrupt {};
  on_interrupt.sa_handler = [](int) { sonar::clients::interrupted = 1; };
  sigaction(SIGINT, &on_interrupt, nullptr);
  sigaction(SIGTERM, &on_interrupt, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  return sonar::clients::run(argc, argv);
}
