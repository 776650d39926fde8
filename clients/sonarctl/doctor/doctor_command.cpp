// Command line of sonarctl doctor.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "clients/sonarctl/command_line.hpp"
#include "clients/sonarctl/doctor/checks.hpp"
#include "clients/sonarctl/doctor/facts.hpp"
#include "clients/sonarctl/terminal.hpp"
#include "core/text/arguments.hpp"

namespace sonar::clients {
namespace {

struct Arguments {
  doctor::Questions questions;
  std::string status_on;
  bool json = false;
};

Result<void> examine(const Arguments& arguments) {
  doctor::Questions questions = arguments.questions;
  const Result<Endpoint> status_on = parse_endpoint(arguments.status_on, questions.status_on);
  if (!status_on) return tl::unexpected(status_on.error());
  questions.status_on = *status_on;
  const Result<doctor::Facts> facts = doctor::gather(questions);
  if (!facts) return tl::unexpected(facts.error());
  const std::vector<doctor::Finding> findings = doctor::run_checks(*facts);
  const bool has_colours = choose_colours(terminal_facts()) != TerminalColours::none;
  std::fputs(arguments.json ? (doctor::json_from(findings) + "\n").c_str() : doctor::text_from(findings, has_colours).c_str(),
             stdout);
  if (!doctor::any_failed(findings)) return {};
  return failure(ErrorKind::unavailable, "a driver would not be served; see the lines that begin with fail");
}

}  // namespace

Run add_doctor(CLI::App& app) {
  CLI::App& command =
      *app.add_subcommand("doctor", "check everything that a driver needs, and report faults with their causes and remedies");
  command.footer(
      "examples:\n"
      "  sonarctl doctor\n"
      "  sonarctl doctor 192.168.2.42 --control 192.168.2.42:14770 --token-file token\n"
      "  sonarctl doctor --json\n"
      "does not connect to a sonar that has a client (--take does); exit code 0 when nothing failed, 69 otherwise");
  const auto arguments = std::make_shared<Arguments>();
  doctor::Questions& questions = arguments->questions;
  command.add_option("ADDRESS", questions.address, "address of one sonar, HOST or HOST:PORT (default: every sonar found)")
      ->check(address());
  command.add_flag("--json", arguments->json, "one JSON object");
  command.add_flag("--take", questions.take,
                   "also connect to sonars that have a client; with clients.when_full: take_over that client is disconnected");
  command.add_option("--within", questions.within_s, "time limit of all checks [s]")
      ->check(text::number(1, 600))
      ->capture_default_str();
  add_control_options(command, questions.control, questions.token_file);
  command
      .add_option("--http", questions.http,
                  "HOST:PORT of sonard's HTTP listener (default: as the daemon reports, else 127.0.0.1:8088)")
      ->check(address());
  command.add_option("--status-on", arguments->status_on, "where to listen for status messages (default 0.0.0.0:52102)")
      ->check(address());
  return [arguments] { return examine(*arguments); };
}

}  // namespace sonar::clients
