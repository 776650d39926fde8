// The list of the commands, and errors as exit codes.

#include "clients/sonarctl/command_line.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>

#include <CLI/CLI.hpp>

#include "clients/sonarctl/net.hpp"
#include "core/base/program_start.hpp"
#include "core/image/colour_map.hpp"
#include "core/text/arguments.hpp"
#include "core/text/format.hpp"

namespace sonar::clients {
namespace {

int complain(const std::string& text, ErrorKind kind) {
  std::fprintf(stderr, "sonarctl: %s\n", text::printable(text).c_str());
  return exit_code(kind);
}

}  // namespace

int run(int argc, char** argv) {
  CLI::App app("sonarctl: receive, show and control the sonars of sonard", "sonarctl");
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string("sonarctl " SONARD_VERSION));
  app.footer(
      "examples:\n"
      "  sonarctl doctor                       check everything that a driver needs\n"
      "  sonarctl view --png ping.png          one picture\n"
      "  sonarctl COMMAND --help               explains a command, with examples");
  const std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  const std::vector<std::pair<std::string, Run>> commands{
      {"doctor", add_doctor(app)},       {"status", add_status(app)},      {"listen", add_listen(app)},
      {"view", add_view(app)},           {"stats", add_stats(app)},        {"record", add_record(app)},
      {"pose", add_pose(app)},           {"events", add_events(app)},      {"set", add_set(app)},
      {"step", add_step(app)},           {"load", add_load(app)},          {"object", add_object(app)},
      {"recording", add_recording(app)}, {"fault", add_fault(app)},        {"scene", add_scene(app)},
      {"farm", add_farm(app, words)},    {"judge", add_judge(app, words)}, {"lab", add_lab(app, words)}};
  if (words.empty()) {
    std::fputs(app.help().c_str(), stderr);
    return exit_code(ErrorKind::usage);
  }
  const bool is_other_program = !words.empty() && (words[0] == "farm" || words[0] == "judge" || words[0] == "lab");
  try {
    text::parse(app, is_other_program ? 2 : argc, argv);
  } catch (const CLI::ParseError& error) {
    const std::string complaint = text::complaint_about(app, error, words);
    if (!complaint.empty()) return complain(complaint, ErrorKind::usage);
    const int code = app.exit(error);
    const Result<void> printed = flush_standard_output();
    return code == 0 && !printed ? complain(printed.error().text, printed.error().kind) : code;
  }
  for (const auto& [name, command] : commands) {
    if (!app.got_subcommand(name)) continue;
    Result<void> done = command();
    const Result<void> printed = flush_standard_output();
    if (done) done = printed;
    return done ? 0 : complain(done.error().text, done.error().kind);
  }
  return exit_code(ErrorKind::bug);
}

namespace {

template <class T>
std::string refusal(const Result<T>& parsed) {
  return parsed ? std::string() : parsed.error().text;
}

}  // namespace

CLI::Validator address() {
  return CLI::Validator([](std::string& given) { return refusal(parse_endpoint(given, {"127.0.0.1", 1})); }, "", "address");
}

CLI::Validator colour_map() {
  return CLI::Validator([](std::string& given) { return refusal(find_colour_map(given)); }, "", "colour map");
}

void add_frame_option(CLI::App& command, control::Frame& frame, const std::string& help) {
  const auto set_frame = [&frame](const std::string& given) {
    frame = given == "ned" ? control::Frame::ned_frd : control::Frame::enu_flu;
  };
  command.add_option_function<std::string>("--frame", set_frame, help)
      ->check(text::one_of({"enu", "ned"}))
      ->transform(text::in_small_letters());
}

void add_control_options(CLI::App& command, std::string& control, std::filesystem::path& token_file) {
  command.add_option("--control", control, "HOST:PORT of sonard's control stream (default 127.0.0.1:14770)")->check(address());
  command.add_option("--token-file", token_file, "the daemon's control.token_file, if it has one");
}

void DeviceArguments::add_to(CLI::App& command, const std::string& port_help) {
  command.add_option("ADDRESS", address, "address of the sonar, HOST or HOST:PORT (default 127.0.0.2)")
      ->check(clients::address());
  command.add_option("--port", port, port_help)->check(text::whole_number(1, 65535));
  command.add_flag("--discover", discover, "use the address in the status broadcast on udp 52102");
  command
      .add_option("--wait", patience_s,
                  "time for which the connection is retried [s]; if above 10, also the time to wait for pings")
      ->check(text::number(0))
      ->capture_default_str();
}

namespace {

using text::number;
using text::one_of;
using text::whole_number;

std::string complaint_about_rate(std::string& given) {
  double hz = 0;
  const auto [end, error] = std::from_chars(given.data(), given.data() + given.size(), hz);
  const bool is_number = error == std::errc{} && end == given.data() + given.size() && hz > 0 && hz <= 1000;
  return is_number || given == "standby" ? "" : "\"" + given + "\" is not a number above 0 and up to 1000, or standby";
}

}  // namespace

void SettingArguments::add_to(CLI::App& app) {
  std::string usual;
  for (const Make& make : protocol::makes())
    if (!make.usual_settings.empty()) usual.append("; of ").append(make.title).append(" ").append(make.usual_settings);
  const std::string heading = "Settings of the sonar (default: the make's own" + usual + ")";
  const auto group = [&heading](CLI::Option* option) { return option->group(heading); };
  const auto value = [&](const char* name, std::optional<double>& to, const char* help) {
    return group(app.add_option_function<double>(
        name, [&to](double given) { to = given; }, help));
  };
  const auto extra = [&](const std::string& name, const char* help) {
    return group(app.add_option("--" + name, more[name], help));
  };
  group(app.add_option_function<std::uint32_t>(
            "--mode", [this](std::uint32_t given) { settings.mode = given - 1; },
            "number from 1 of a frequency or a head, in the order of the sonar's model"))
      ->check(whole_number(1, 100));
  CLI::Option* metres = value("--range", settings.range_m, "metres")->check(number(0.0, 1000.0));
  extra("range-percent", "range in per cent of the mode's maximum, instead of metres")
      ->check(number(0.0, 100.0))
      ->excludes(metres);
  value("--gain", settings.gain_percent, "gain in per cent of the possible range")->check(number(0.0, 100.0));
  group(app.add_option_function<std::string>(
            "--rate", [this](const std::string& given) { settings.rate_hz = given == "standby" ? 0 : std::stod(given); },
            "maximum ping rate [Hz], or standby; some makes use the nearest of their own rates"))
      ->check(CLI::Validator(complaint_about_rate, "2|5|10|15|40|standby", "rate"));
  group(app.add_option_function<std::uint32_t>(
            "--beams", [this](std::uint32_t given) { settings.beams = given; }, "default: 512"))
      ->check(one_of({"256", "512"}));
  group(app.add_option_function<std::uint32_t>(
            "--bits", [this](std::uint32_t given) { settings.sample_bits = given; },
            "bits per sample; 32 needs --version 2. Default: 8"))
      ->check(one_of({"8", "16", "32"}));
  extra("gamma", "wire value: gamma = value / 255. Default: 127")->check(whole_number(0, 255));
  extra("speed-of-sound", "m/s; 0 (default) = the sonar computes it")->check(number(0.0, 2000.0));
  extra("salinity", "ppt. Default: 0")->check(number(0.0, 50.0));
  extra("version", "version of the messages. Default: 0")->check(whole_number(0, 2));
  group(app.add_flag_function(
      "--gains", [this](std::int64_t) { settings.row_gains = true; }, "request a gain before every row"));
  group(app.add_flag_function(
      "--gain-assist", [this](std::int64_t) { more["gain-assist"] = "on"; }, "set bit 4 of the flags"));
  group(app.add_flag_function(
      "--trigger", [this](std::int64_t) { more["trigger"] = "on"; }, "one ping for each request (network trigger)"));
}

protocol::Wanted SettingArguments::wanted() const {
  protocol::Wanted wanted;
  wanted.settings = settings;
  for (const auto& [name, given] : more)
    if (!given.empty()) wanted.more.emplace(name, given);
  return wanted;
}

void SourceArguments::add_to(CLI::App& app, bool recordings, const std::string& control_help) {
  std::string usual;
  std::vector<std::string> names;
  for (const Make& one : protocol::makes()) {
    usual += (usual.empty() ? "" : ", ") + std::to_string(one.ports.front().number) + " of " + std::string(one.title);
    names.emplace_back(one.name());
  }
  device.add_to(app, "port of the sonar (default: " + usual + ", the first make that answers)");
  app.add_option("--make", make, "make of the sonar; needed on a port that is not the make's own")->check(one_of(names));
  app.add_flag("--as-it-is", as_it_is, "send no settings (many sonars then send no pings)");
  app.add_flag("--observe", observe,
               "receive the pings that clients request, without occupying a client slot or sending settings");
  CLI::Option* const stream = app.add_option("--control", control, "HOST:PORT of sonard's control stream, which " + control_help)
                                  ->check(clients::address());
  app.add_option("--token-file", token_file, "the daemon's control.token_file, if it has one");
  settings.add_to(app);
  if (!recordings) return;
  CLI::Option* const from =
      app.add_option("--from,--from-raw", recording, "read this recording, of any kind, instead of a sonar")->excludes(stream);
  app.add_option("--sonar", sonar, "with --from: selects one of several sonars, by address in captures, by name in MCAP")
      ->needs(from);
}

Result<SourceOptions> SourceArguments::finish() const {
  SourceOptions source;
  Result<Endpoint> at = parse_endpoint(device.address, {"127.0.0.2", device.port});
  if (!at) return tl::unexpected(at.error());
  std::error_code ec;
  // A file may have the name of a host.
  const auto is_no_host = [&at] {
    const auto found = resolve(*at);
    return !found && found.error().kind == ErrorKind::usage;
  };
  if (at->host.find('/') != std::string::npos || (std::filesystem::is_regular_file(at->host, ec) && is_no_host()))
    return failure(ErrorKind::usage, "\"" + device.address + "\" is a file, not the address of a sonar: view, stats and record " +
                                         "read a recording with --from FILE");
  source.make = make.empty() ? nullptr : protocol::find_make(make);
  if (device.discover && !make.empty() && source.make != &protocol::makes().front())
    return failure(ErrorKind::usage, "--discover finds " + std::string(protocol::makes().front().title) +
                                         " only: leave it out, and give the address of " + std::string(source.make->title));
  source.device = *at;
  source.discover = device.discover;
  source.recording = recording;
  source.sonar = sonar;
  source.connect_patience_s = device.patience_s;
  source.silence_limit_s = std::max(source.silence_limit_s, device.patience_s);
  source.observe = observe;
  source.control = control;
  source.token_file = token_file;
  source.wanted = settings.wanted();
  source.wanted.as_it_is = as_it_is;
  return source;
}

}  // namespace sonar::clients
