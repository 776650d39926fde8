// Command line of recording: files that a running sonard writes on its own computer.
#include <CLI/CLI.hpp>
#include <memory>

#include "clients/sonarctl/argument_checks.hpp"
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
  CLI::App& recording =
      *app.add_subcommand("recording", "files written by a running sonard, with true poses and the first object of each beam");
  recording.require_subcommand(1);
  recording.footer(
      "examples:\n"
      "  sonarctl recording start run-1.mcap          in the folder that its configuration names\n"
      "  sonarctl recording stop\n"
      "sonarctl status lists the recordings; sonarctl record writes files here, as a client of the sonar");
  const auto arguments = std::make_shared<RecordingArguments>();
  RecordingArguments& a = *arguments;

  CLI::App& start =
      add_command(recording, "start", "start a file; its suffix selects the format: " + recording::file_endings(), a);
  start.add_option("FILE", a.start.file, "file name, without a folder")->required();
  start.add_option("--sonar", a.start.sonar, "name of the sonar (default: the only one)");
  start.add_flag("--labels", a.start.labels,
                 "in .mcap, also which object's echo each sample holds; pings take about twice as long");
  start.footer(
      "examples:\n"
      "  sonarctl recording start run-1.mcap --labels\n"
      "  sonarctl recording start left.pcap --sonar left");
  start.callback([&a] {
    a.what = [&a] { return steer(a.control, a.start, a.start.file + " is being recorded; sonarctl status shows how it goes"); };
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
