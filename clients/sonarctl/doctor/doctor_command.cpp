// doctor on the command line.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "clients/sonarctl/argument_checks.hpp"
#include "clients/sonarctl/command_line.hpp"
#include "clients/sonarctl/doctor/gather.hpp"
#include "clients/sonarctl/doctor/judge.hpp"
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
  const std::vector<doctor::Finding> findings = doctor::judge(*facts);
  std::fputs(arguments.json ? (doctor::json_from(findings) + "\n").c_str() : doctor::text_from(findings).c_str(), stdout);
  if (!doctor::any_failed(findings)) return {};
  return failure(ErrorKind::unavailable, "a driver would not be served as it is; the lines that begin with fail say why");
}

}  // namespace

Run add_doctor(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("doctor", "is everything as a driver needs it? Each check with cause and cure");
  command.footer(
      "examples:\n"
      "  sonarctl doctor\n"
      "  sonarctl doctor 192.168.2.42 --control 192.168.2.42:14770 --token-file token\n"
      "  sonarctl doctor --json\n"
      "a sonar that has a client is left alone (--take connects anyway); exit code 0 when nothing failed, 69 otherwise");
  const auto arguments = std::make_shared<Arguments>();
  doctor::Questions& questions = arguments->questions;
  command.add_option("ADDRESS", questions.address, "of one sonar, HOST or HOST:PORT; left out: every sonar that can be found")
      ->check(address());
  command.add_flag("--json", arguments->json, "one JSON object");
  command.add_flag("--take", questions.take,
                   "connect to sonars that have a client, too; with clients.when_full: take_over it loses its place");
  command.add_option("--within", questions.within_s, "seconds that all checks together may take")
      ->check(text::number(1, 600))
      ->capture_default_str();
  command.add_option("--control", questions.control, "HOST:PORT of sonard's control stream (default 127.0.0.1:14770)")
      ->check(address());
  command.add_option("--token-file", questions.token_file, "the daemon's control.token_file, when it has one");
  command
      .add_option("--http", questions.http,
                  "HOST:PORT of sonard's HTTP listener (default: where the daemon says, else 127.0.0.1:8088)")
      ->check(address());
  command.add_option("--status-on", arguments->status_on, "where to listen for status messages (default 0.0.0.0:52102)")
      ->check(address());
  return [arguments] { return examine(*arguments); };
}

}  // namespace sonar::clients
