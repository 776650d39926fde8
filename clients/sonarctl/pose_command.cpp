// Command line of `sonarctl pose once|circle|line`.
#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>

#include "clients/sonarctl/command_line.hpp"
#include "clients/sonarctl/commands.hpp"
#include "core/text/arguments.hpp"

namespace sonar::clients {
namespace {

using text::number;

void add_pose_options(CLI::App& command, PoseOptions& options) {
  command.add_option("--to", options.to, "HOST:PORT of sonard (default 127.0.0.1:14770, with --json :14771)")->check(address());
  command.add_flag("--json", options.json, "send JSON lines with ArduPilot's keys, not protobuf");
  command.add_flag("--confirm", options.confirm, "use the TCP control stream; sonard confirms each pose");
  command.add_option("--token-file", options.token_file, "with --confirm or --object: the daemon's control.token_file");
  add_frame_option(command, options.frame, "frame of the arguments and of the sent poses: enu (FLU body) or ned (FRD body)");
  command.add_option("--vehicle", options.vehicle, "name of the vehicle, if there are several");
  command.add_option("--object", options.object, "move an object of the scene instead");
  command.add_option("--rate", options.rate_hz, "poses per second")->check(number(0.001, 1000.0))->capture_default_str();
  command.add_option("--seconds", options.seconds, "duration in seconds; 0 = one pose, one turn or one line")->check(number(0));
}

void add_triple(CLI::App& command, const std::string& name, std::vector<double>& value, const std::string& help) {
  command.add_option(name, value, help)->expected(3)->delimiter(',')->check(number(-1e7, 1e7))->capture_default_str();
}

}  // namespace

Run add_pose(CLI::App& app) {
  CLI::App& pose = *app.add_subcommand("pose", "send poses of a vehicle or an object to sonard");
  pose.require_subcommand(1);
  pose.footer(
      "examples:\n"
      "  sonarctl pose once --xyz 0,0,-3 --rpy 0,10,90\n"
      "  sonarctl pose once --frame ned --xyz 0,0,3 --json\n"
      "  sonarctl pose circle --centre 0,0,-3 --radius 6 --period 40 --pitch -15\n"
      "  sonarctl pose line --from 0,-8,-4 --to-point 0,8,-4 --speed 0.5 --object diver");
  const auto options = std::make_shared<PoseOptions>();

  CLI::App& once = *pose.add_subcommand("once", "one pose; repeated with --seconds");
  add_triple(once, "--xyz", options->position_m, "position, m");
  add_triple(once, "--rpy", options->rpy_deg, "roll, pitch, yaw in degrees, intrinsic Z-Y-X");
  once.callback([options] { options->path = PoseOptions::Path::once; });

  CLI::App& circle = *pose.add_subcommand("circle", "circle around a centre, with the bow towards it");
  add_triple(circle, "--centre", options->centre_m, "m");
  circle.add_option("--radius", options->radius_m, "m")->check(number(0.0, 1e6))->capture_default_str();
  circle.add_option("--period", options->period_s, "seconds per turn; negative = clockwise")
      ->check(number())
      ->capture_default_str();
  circle.add_option("--pitch", options->pitch_deg, "degrees, bow up positive")->check(number(-90.0, 90.0));
  circle.add_flag("!--look-ahead", options->look_inwards, "keep the bow along the path");
  circle.callback([options] { options->path = PoseOptions::Path::circle; });

  CLI::App& line = *pose.add_subcommand("line", "move from one point to another, with the bow ahead");
  add_triple(line, "--from", options->from_m, "m");
  add_triple(line, "--to-point", options->to_m, "m");
  line.add_option("--speed", options->speed_mps, "m/s")->check(number(1e-3, 1e3))->capture_default_str();
  line.add_option("--pitch", options->pitch_deg, "degrees, bow up positive")->check(number(-90.0, 90.0));
  line.callback([options] { options->path = PoseOptions::Path::line; });

  for (CLI::App* command : {&once, &circle, &line}) add_pose_options(*command, *options);
  return [options]() -> Result<void> {
    if (options->path == PoseOptions::Path::circle && std::abs(options->period_s) < 0.01)
      return failure(ErrorKind::usage, "--period must be 0.01 s or more, or -0.01 s or less (clockwise)");
    return send_poses(*options);
  };
}

}  // namespace sonar::clients
