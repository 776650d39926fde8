// Command line of `sonarctl recording`, which makes a running sonard record into files on its own computer.
#include <CLI/CLI.hpp>
#include <memory>

#include "clients/sonarctl/command_line.hpp"
#include "clients/sonarctl/control/control_commands.hpp"
#include "protocol/recording/recording.hpp"

namespace sonar::clients {
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
