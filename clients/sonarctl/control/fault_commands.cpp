// Command line of fault: the faults of a running sonard that was started with --faults.

#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>

#include "clients/sonarctl/command_line.hpp"
#include "clients/sonarctl/control/control_commands.hpp"
#include "clients/sonarctl/control/status_text.hpp"
#include "core/text/arguments.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/fault_kinds.hpp"
#include "protocol/recording/recording.hpp"

namespace sonar::clients {
namespace {

using text::number;
using text::whole_number;

struct FaultArguments {
  ControlOptions control;
  control::FaultRecord record;
  std::vector<std::string> with, at;
  std::string ended;
  bool json = false, support = false, follow = false;
  std::function<Result<void>()> what;
};

/// The returned pointer keeps the Response that contains the report.
Result<std::shared_ptr<const v1::FaultReport>> report_of(ControlClient& client, const control::GetFaults& wanted) {
  const auto answer = client.request(wanted);
  if (!answer) return tl::unexpected(answer.error());
  if (!(*answer)->has_faults()) return failure(ErrorKind::bad_data, "sonard answered the request for faults without a report");
  return std::shared_ptr<const v1::FaultReport>(*answer, &(*answer)->faults());
}

void print(const FaultArguments& a, const v1::FaultReport& report, std::string (*text)(const v1::FaultReport&)) {
  std::fputs(a.json ? (control::json_of(report) + "\n").c_str() : text(report).c_str(), stdout);
}

Result<void> print_report(const FaultArguments& a, bool kinds, std::string (*text)(const v1::FaultReport&)) {
  auto client = ControlClient::open(a.control);
  if (!client) return tl::unexpected(client.error());
  const auto report = report_of(*client, {.kinds = kinds, .journal_after = std::numeric_limits<std::uint64_t>::max()});
  if (!report) return tl::unexpected(report.error());
  print(a, **report, text);
  return {};
}

/// Prints the kinds of this sonarctl, without a daemon.
Result<void> print_own_kinds(const FaultArguments& a) {
  v1::FaultReport report;
  for (const FaultKind& kind : fault_kinds()) fill(*report.add_kinds(), kind);
  for (const Trouble& trouble : troubles()) fill(*report.add_troubles(), trouble);
  print(a, report, fault_kinds_text);
  return {};
}

/// Prints the journal. With `follow` the subscription comes first, so that no entry is missed between the report and the first
/// event.
Result<void> print_journal(const FaultArguments& a) {
  auto client = ControlClient::open(a.control);
  if (!client) return tl::unexpected(client.error());
  if (a.follow)
    if (const auto subscribed = client->request(control::Subscribe{.faults = true}); !subscribed)
      return tl::unexpected(subscribed.error());
  const auto report = report_of(*client, {});
  if (!report) return tl::unexpected(report.error());
  std::uint64_t last = 0;
  const auto print = [&](const v1::FaultEntry& entry) {
    if (entry.seq() <= last) return true;
    last = entry.seq();
    std::puts(a.json ? control::json_of(entry).c_str() : text_from(entry).c_str());
    return std::fflush(stdout) == 0;  // if not, the output is closed
  };
  bool open = true;
  for (const v1::FaultEntry& entry : (*report)->journal()) open = open && print(entry);
  while (open && a.follow && interrupted == 0) {
    const auto event = client->next_event(std::chrono::milliseconds(100));
    if (!event) return tl::unexpected(event.error());
    if (*event && (*event)->has_fault()) open = print((*event)->fault());
  }
  return {};
}

Result<void> request_fault(FaultArguments& a) {
  if (Result<void> read = read_parameters(a.with, a.record); !read) return read;
  if (Result<void> read = read_trigger(a.at, a.record); !read) return read;
  return steer(a.control, control::AddFault{a.record}, a.record.what + " is added; sonarctl fault list shows its state");
}

CLI::App& add_command(CLI::App& fault, FaultArguments& a, const std::string& name, const std::string& help,
                      const std::string& example, std::function<Result<void>()> what) {
  CLI::App& command = *fault.add_subcommand(name, help);
  command.footer("examples:\n" + example);
  add_control_options(command, a.control.address, a.control.token_file);
  command.callback([&a, what = std::move(what)] { a.what = what; });
  return command;
}

void add_add(CLI::App& fault, FaultArguments& a) {
  CLI::App& add = add_command(fault, a, "add", "let a fault begin, now or at a ping, a time, an occasion",
                              "  sonarctl fault add silent-open --seconds 6\n"
                              "  sonarctl fault add F01 --with bytes=1 --with fill=zero --at ping=200 --sonar front\n"
                              "  sonarctl fault add F19 --at every=50 --client newest --count 3 --name flips\n"
                              "  sonarctl fault add L05 --at on=connect --seconds 2\n"
                              "  sonarctl fault add power-cycle --with severity=1",
                              [&a] { return request_fault(a); });
  control::FaultRecord& r = a.record;
  const auto number_to = [&](const char* name, auto& value, const char* help) {
    return add.add_option_function<typename std::remove_reference_t<decltype(value)>::value_type>(
        name, [&value](const auto& given) { value = given; }, help);
  };
  add.add_option("FAULT", r.what, "code or name of a kind, or a trouble: sonarctl fault kinds lists them")->required();
  add.add_option("--with", a.with, "a parameter, NAME=VALUE; may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  add.add_option("--at", a.at, "ping=N, every=N, phase=N, time_s=S, probability=P or on=OCCASION (default: now)")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  number_to("--seconds", r.lasts.seconds, "duration of each occurrence")->check(number(0));
  number_to("--pings", r.lasts.pings, "number of pings of each occurrence")->check(whole_number(1));
  number_to("--count", r.lasts.count, "number of occurrences")->check(whole_number(1));
  add.add_option("--sonar", r.sonar, "name of the sonar (default: all)");
  add.add_option("--client", r.client, "newest, oldest, an ordinal, an address or a prefix 10.0.0.0/8 (default: all)");
  add.add_option("--name", r.name, "its name (default: FAULT)");
}

}  // namespace

Run add_fault(CLI::App& app) {
  CLI::App& fault = *app.add_subcommand("fault", "inject faults into a sonard that runs with --faults");
  fault.require_subcommand(1);
  fault.footer(
      "examples:\n"
      "  sonarctl fault kinds                         all kinds and troubles\n"
      "  sonarctl fault add silent-open --seconds 6\n"
      "  sonarctl fault list\n"
      "  sonarctl fault journal --follow              the effects: which client, at which byte");
  const auto arguments = std::make_shared<FaultArguments>();
  FaultArguments& a = *arguments;
  add_add(fault, a);
  CLI::App& list = add_command(
      fault, a, "list", "list the waiting, active and ended faults", "  sonarctl fault list\n  sonarctl fault list --support",
      [&a] { return a.support ? print_report(a, true, fault_support_text) : print_report(a, false, fault_list_text); });
  list.add_flag("--support", a.support,
                "list the kinds that take effect on each vendor's sonars, and the reasons for the others");
  CLI::App& kinds = add_command(fault, a, "kinds",
                                "the catalogue: kinds with their parameters, and troubles; with --control, those of that daemon",
                                "  sonarctl fault kinds", [&a, &fault] {
                                  const bool asks = fault.get_subcommand("kinds")->count("--control") > 0;
                                  return asks ? print_report(a, true, fault_kinds_text) : print_own_kinds(a);
                                });
  CLI::App& journal = add_command(fault, a, "journal", "the effects of faults, the latest 1000 entries",
                                  "  sonarctl fault journal --follow --json", [&a] { return print_journal(a); });
  journal.add_flag("--follow", a.follow, "then print each new entry, until Ctrl-C");
  for (CLI::App* command : {&list, &kinds, &journal}) command->add_flag("--json", a.json, "JSON (names as in control.proto)");
  CLI::App& remove = add_command(fault, a, "remove", "end a waiting or active fault", "  sonarctl fault remove flips", [&a] {
    return steer(a.control, control::EndFaults{a.ended}, "fault " + a.ended + " is ended");
  });
  remove.add_option("NAME", a.ended, "its name in fault list")->required();
  add_command(fault, a, "reset", "end all faults", "  sonarctl fault reset",
              [&a] { return steer(a.control, control::EndFaults{}, "all faults are ended"); });
  return [arguments] { return arguments->what(); };
}

// Command line of `sonarctl recording`, which makes a running sonard record into files on its own computer.

namespace {

struct RecordingArguments {
  ControlOptions control;
  control::StartRecording start;
  control::StopRecording stop;
  std::function<Result<void>()> what;
};

CLI::App& add_command(CLI::App& recording, const std::string& name, const std::string& help, RecordingArguments& arguments) {
  CLI::App& command = *recording.add_subcommand(name, help);
  add_control_options(command, arguments.control.address, arguments.control.token_file);
  return command;
}

}  // namespace

Run add_recording(CLI::App& app) {
  CLI::App& recording = *app.add_subcommand(
      "recording", "start or stop files that a running sonard records, with true poses and the first object that each beam hits");
  recording.require_subcommand(1);
  recording.footer(
      "examples:\n"
      "  sonarctl recording start run-1.mcap          in the folder that sonard's configuration names\n"
      "  sonarctl recording stop\n"
      "sonarctl status lists the recordings; sonarctl record connects as a client of the sonar and writes files on this "
      "computer");
  const auto arguments = std::make_shared<RecordingArguments>();
  RecordingArguments& a = *arguments;

  CLI::App& start =
      add_command(recording, "start", "start a file; its suffix selects the format: " + recording::file_endings(), a);
  start.add_option("FILE", a.start.file, "file name, without a folder")->required();
  start.add_option("--sonar", a.start.sonar, "name of the sonar (default: the only one)");
  start.add_flag(
      "--labels", a.start.labels,
      "only .mcap: also record which object's echo each sample holds; computing a ping then takes about twice as long");
  start.footer(
      "examples:\n"
      "  sonarctl recording start run-1.mcap --labels\n"
      "  sonarctl recording start left.pcap --sonar left");
  start.callback([&a] {
    a.what = [&a] { return steer(a.control, a.start, "recording to " + a.start.file + "; sonarctl status shows its progress"); };
  });

  CLI::App& stop = add_command(recording, "stop", "finish a file, or all of them", a);
  stop.add_option("FILE", a.stop.file, "name of the file (default: all)");
  stop.footer("examples:\n  sonarctl recording stop\n  sonarctl recording stop run-1.mcap");
  stop.callback([&a] {
    a.what = [&a] {
      return steer(a.control, a.stop,
                   (a.stop.file.empty() ? "all recordings are" : a.stop.file + " is") + std::string(" complete"));
    };
  });
  return [arguments] { return arguments->what(); };
}

}  // namespace sonar::clients
