// The list of the commands, and errors as exit codes.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "clients/sonarctl/command_line.hpp"
#include "clients/sonarctl/commands.hpp"
#include "core/base/standard_streams.hpp"
#include "core/text/arguments.hpp"

namespace sonar::clients {
namespace {

int complain(const std::string& text, ErrorKind kind) {
  std::fprintf(stderr, "sonarctl: %s\n", text.c_str());
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

}  // namespace sonar::clients
