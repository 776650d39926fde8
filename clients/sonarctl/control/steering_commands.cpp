// Command lines of status, events, set, step, load and object, which use the control stream.
#include <CLI/CLI.hpp>
#include <memory>
#include <utility>

#include "clients/sonarctl/command_line.hpp"
#include "clients/sonarctl/control/control_commands.hpp"
#include "core/text/arguments.hpp"

namespace sonar::clients {
namespace {

using text::number;
using text::one_of;
using text::whole_number;

void add_control_options(CLI::App& command, ControlOptions& control) {
  clients::add_control_options(command, control.address, control.token_file);
}

/// Reads the pose of a body from the command line and converts it from the given frame to ENU/FLU.
struct PlaceArguments {
  std::vector<double> xyz_m, rpy_deg{0, 0, 0};
  control::Frame frame = control::Frame::enu_flu;

  void add_to(CLI::App& command, bool required) {
    CLI::Option* place = command.add_option("--xyz", xyz_m, "position, m")->expected(3)->delimiter(',')->check(number());
    if (required) place->required();
    command.add_option("--rpy", rpy_deg, "roll, pitch, yaw in degrees, intrinsic Z-Y-X (default 0,0,0)")
        ->expected(3)
        ->delimiter(',')
        ->check(number());
    add_frame_option(command, frame, "frame of the pose: enu (FLU body, default) or ned (FRD body)");
  }
  Pose pose() const {
    const RollPitchYaw rpy{rad_from_deg(rpy_deg[0]), rad_from_deg(rpy_deg[1]), rad_from_deg(rpy_deg[2])};
    const Pose given{{xyz_m[0], xyz_m[1], xyz_m[2]}, quat_from_rpy(rpy)};
    return frame == control::Frame::ned_frd ? enu_flu_from_ned_frd(given) : given;
  }
};

/// Adds an option that sets `value` only if it is given.
template <class T>
CLI::Option* add_optional(CLI::App& command, const std::string& name, std::optional<T>& value, const std::string& help) {
  return command.add_option_function<T>(
      name, [&value](const T& given) { value = given; }, help);
}

std::string name_or_its(const std::string& name) { return name.empty() ? "the sonar" : name; }

/// All sub-commands share the ControlOptions; the selected sub-command sets `what`.
struct Steering {
  ControlOptions control;
  std::function<Result<void>()> what;
};

struct SonarArguments {
  control::SetSonar sonar;
  std::string transmit;
  std::vector<double> mount_xyz_m, mount_rpy_deg;
  std::string mount_frame = "frd";

  Result<control::SetSonar> finish() const {
    control::SetSonar finished = sonar;
    if (!transmit.empty()) finished.transmit = transmit == "on";
    const std::vector<double>&at = mount_xyz_m, &rpy_deg = mount_rpy_deg;
    Pose given;
    if (!at.empty()) given.position_m = {at[0], at[1], at[2]};
    if (!rpy_deg.empty())
      given.orientation = quat_from_rpy({rad_from_deg(rpy_deg[0]), rad_from_deg(rpy_deg[1]), rad_from_deg(rpy_deg[2])});
    const Pose mount = mount_frame == "frd" ? flu_from_frd(given) : given;
    if (!at.empty() || !rpy_deg.empty()) finished.mount.emplace();
    if (!at.empty()) finished.mount->position_m = mount.position_m;
    if (!rpy_deg.empty()) finished.mount->orientation = mount.orientation;
    const bool any = finished.range_m || finished.rate_hz || finished.gain_percent || finished.mode || finished.beams ||
                     finished.transmit || finished.mount;
    if (!any)
      return failure(ErrorKind::usage,
                     "nothing to set: give --range, --rate, --gain, --mode, --beams, --transmit, --mount or --mount-rpy");
    return finished;
  }
};

void add_set_sonar(CLI::App& set, const std::shared_ptr<Steering>& steering) {
  CLI::App& command = *set.add_subcommand("sonar", "change settings as a client of the sonar does; the latest request applies");
  command.footer(
      "examples:\n"
      "  sonarctl set sonar --range 5 --rate 5\n"
      "  sonarctl set sonar front --transmit off\n"
      "  sonarctl set sonar --mount 0.3,0,0.1 --mount-rpy 0,-30,0        a tilt head, FRD");
  const auto arguments = std::make_shared<SonarArguments>();
  control::SetSonar& s = arguments->sonar;
  add_control_options(command, steering->control);
  command.add_option("SONAR", s.sonar, "its name (default: the only one)");
  add_optional(command, "--range", s.range_m, "metres")->check(number());
  add_optional(command, "--rate", s.rate_hz, "ping rate [Hz], rounded to a rate that the product has; 0 = standby")
      ->check(number());
  add_optional(command, "--gain", s.gain_percent, "per cent")->check(number());
  command
      .add_option_function<std::uint32_t>(
          "--mode", [&s](std::uint32_t given) { s.mode = given - 1; },
          "number from 1 of a frequency or a head, in the order of the sonar's model")
      ->check(whole_number(1, 100));
  add_optional(command, "--beams", s.beams, "number of beams; depends on the product")->check(whole_number(0, 65535));
  command.add_option("--transmit", arguments->transmit, "on, or off: receive only noise, for all clients")
      ->check(one_of({"on", "off"}));
  command.add_option("--mount", arguments->mount_xyz_m, "X,Y,Z of the sonar on its vehicle, m")
      ->expected(3)
      ->delimiter(',')
      ->check(number());
  command.add_option("--mount-rpy", arguments->mount_rpy_deg, "roll, pitch, yaw of the sonar on its vehicle, degrees")
      ->expected(3)
      ->delimiter(',')
      ->check(number());
  command.add_option("--mount-frame", arguments->mount_frame, "frame of the mount: frd (default) or flu")
      ->check(one_of({"frd", "flu"}));
  command.callback([steering, arguments] {
    steering->what = [steering, arguments]() -> Result<void> {
      const Result<control::SetSonar> wanted = arguments->finish();
      if (!wanted) return tl::unexpected(wanted.error());
      const Result<void> done =
          steer(steering->control, *wanted, name_or_its(wanted->sonar) + " is set; sonarctl status shows the resulting settings");
      if (!done && wanted->mode && done.error().text.find("counted from 0") != std::string::npos)
        return failure(done.error().kind, done.error().text + " (--mode counts from 1)");
      return done;
    };
  });
}

void add_set_water(CLI::App& set, const std::shared_ptr<Steering>& steering) {
  CLI::App& command = *set.add_subcommand("water", "change the temperature, salinity, pH or speed of sound of the water");
  command.footer(
      "examples:\n"
      "  sonarctl set water --temperature 8 --salinity 34\n"
      "  sonarctl set water --sound-speed 0                 computed from the rest again");
  const auto water = std::make_shared<control::SetEnvironment>();
  add_control_options(command, steering->control);
  add_optional(command, "--temperature", water->temperature_c, "C")->check(number());
  add_optional(command, "--salinity", water->salinity_psu, "psu")->check(number());
  add_optional(command, "--ph", water->ph, "")->check(number());
  add_optional(command, "--sound-speed", water->sound_speed_mps, "m/s; 0 = computed from the rest")->check(number());
  command.callback([steering, water] {
    steering->what = [steering, water]() -> Result<void> {
      if (!water->temperature_c && !water->salinity_psu && !water->ph && !water->sound_speed_mps)
        return failure(ErrorKind::usage, "nothing to set: give --temperature, --salinity, --ph or --sound-speed");
      return steer(steering->control, *water, "the water is set");
    };
  });
}

struct TrajectoryArguments {
  control::SetTrajectory wanted;
  bool object = false, pause = false, resume = false;

  Result<control::SetTrajectory> finish() const {
    control::SetTrajectory finished = wanted;
    if (object) finished.of = control::PoseSample::Of::object;
    if (object && finished.name.empty()) return failure(ErrorKind::usage, "give the name of the object");
    if (pause && resume) return failure(ErrorKind::usage, "give --pause or --resume, not both");
    if (pause || resume) finished.paused = pause;
    if (!finished.paused && !finished.position_s && !finished.speed)
      return failure(ErrorKind::usage, "nothing to change: give --pause, --resume, --seek or --speed");
    return finished;
  }
};

void add_set_trajectory(CLI::App& set, const std::shared_ptr<Steering>& steering) {
  CLI::App& command = *set.add_subcommand("trajectory", "pause, resume, seek or change the speed of a body's trajectory file");
  command.footer(
      "examples:\n"
      "  sonarctl set trajectory --pause\n"
      "  sonarctl set trajectory rov --seek 90 --speed 4 --resume\n"
      "  sonarctl set trajectory buoy --object --seek 0");
  const auto arguments = std::make_shared<TrajectoryArguments>();
  add_control_options(command, steering->control);
  command.add_option("NAME", arguments->wanted.name, "name of the vehicle (default: the only one)");
  command.add_flag("--object", arguments->object, "NAME is a moving object of the scene");
  command.add_flag("--pause", arguments->pause, "stop the body where it is");
  command.add_flag("--resume", arguments->resume, "continue after --pause");
  add_optional(command, "--seek", arguments->wanted.position_s, "seconds from the start of the trajectory")->check(number(0));
  add_optional(command, "--speed", arguments->wanted.speed, "seconds of the trajectory per second of the clock")
      ->check(number(0.001, 1000));
  command.callback([steering, arguments] {
    steering->what = [steering, arguments]() -> Result<void> {
      const Result<control::SetTrajectory> wanted = arguments->finish();
      if (!wanted) return tl::unexpected(wanted.error());
      return steer(steering->control, *wanted, "done; sonarctl status shows the position");
    };
  });
}

/// Executes `what`, which owns the Steering that contains it: moving it out ends this cycle of owners.
Run run_of(const std::shared_ptr<Steering>& steering) {
  return [steering] { return std::exchange(steering->what, {})(); };
}

}  // namespace

Run add_status(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("status", "status of a running sonard: sonars, clients, statistics, vehicles");
  command.footer(
      "examples:\n"
      "  sonarctl status\n"
      "  sonarctl status --watch\n"
      "  sonarctl status --json | jq '.sonars[].figures'");
  const auto options = std::make_shared<StatusOptions>();
  add_control_options(command, options->control);
  command.add_flag("--json", options->json, "one JSON object (names as in control.proto)");
  command.add_flag("--watch", options->watch, "repeat until Ctrl-C");
  command.add_option("--period", options->period_s, "interval with --watch [s]")
      ->check(number(0.05, 3600.0))
      ->capture_default_str();
  return [options] { return print_status(*options); };
}

Run add_events(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("events", "print the events of a running sonard");
  command.footer(
      "examples:\n"
      "  sonarctl events                              clients, poses, scenes and faults\n"
      "  sonarctl events --pings --count 10 --json");
  const auto options = std::make_shared<EventsOptions>();
  add_control_options(command, options->control);
  command.add_flag("--pings", options->wanted.pings, "every ping");
  command.add_flag("--clients", options->wanted.clients, "clients that connect and disconnect");
  command.add_flag("--poses", options->wanted.poses, "poses that stop, resume or change their source");
  command.add_flag("--scene", options->wanted.scene, "scenes loaded and changed");
  command.add_flag("--faults", options->wanted.faults, "faults: their begin, effects and end");
  command.add_option("--count", options->count, "stop after this number of events")->check(whole_number());
  command.add_option("--seconds", options->seconds, "stop after this time")->check(number(0));
  command.add_flag("--json", options->json, "one JSON object per line");
  return [options] {
    control::Subscribe& wanted = options->wanted;
    if (!wanted.pings && !wanted.clients && !wanted.poses && !wanted.scene && !wanted.faults)
      wanted.clients = wanted.poses = wanted.scene = wanted.faults = true;
    return print_events(*options);
  };
}

Run add_set(CLI::App& app) {
  CLI::App& set = *app.add_subcommand("set", "change a sonar, the water or a trajectory of a running sonard");
  set.require_subcommand(1);
  set.footer(
      "examples:\n"
      "  sonarctl set sonar --range 5 --rate 5\n"
      "  sonarctl set water --temperature 8\n"
      "  sonarctl set trajectory --seek 90 --speed 4");
  const auto steering = std::make_shared<Steering>();
  add_set_sonar(set, steering);
  add_set_water(set, steering);
  add_set_trajectory(set, steering);
  return run_of(steering);
}

Run add_step(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("step", "advance the time of a sonard with clock: lockstep and wait for the pings due");
  command.footer(
      "examples:\n"
      "  sonarctl step 0.1                        0.1 s; a ping that is due exactly at its end belongs to the next step\n"
      "  sonarctl step 0.1 --count 50");
  const auto options = std::make_shared<StepOptions>();
  add_control_options(command, options->control);
  command.add_option("SECONDS", options->dt_s, "more than 0, at most 3600")->required()->check(number(0, 3600));
  command.add_option("--count", options->count, "number of steps (default 1)")->check(whole_number(1));
  command.add_flag("--json", options->json, "one JSON object per step");
  return [options] { return step_time(*options); };
}

Run add_load(CLI::App& app) {
  CLI::App& command =
      *app.add_subcommand("load", "load another scene into a running sonard; pings use the old one until it is loaded");
  command.footer(
      "examples:\n"
      "  sonarctl load scenes/tank-rod.yaml           a file of this computer\n"
      "  sonarctl load local-search.yaml              a file that sonard finds: beside its configuration, or shipped");
  struct Arguments {
    ControlOptions control;
    std::string path;
  };
  const auto arguments = std::make_shared<Arguments>();
  add_control_options(command, arguments->control);
  command.add_option("SCENE", arguments->path, "scene file")->required();
  return [arguments] { return load_scene(arguments->control, arguments->path); };
}

namespace {

struct ObjectArguments {
  std::string name;
  control::AddObject added;
  PlaceArguments place;
};

CLI::App& add_object_command(CLI::App& object, const std::string& name, const std::string& help,
                             const std::shared_ptr<Steering>& steering, const std::shared_ptr<ObjectArguments>& arguments) {
  CLI::App& command = *object.add_subcommand(name, help);
  add_control_options(command, steering->control);
  if (name != "list") command.add_option("OBJECT", arguments->name, "its name")->required();
  return command;
}

}  // namespace

Run add_object(CLI::App& app) {
  CLI::App& object = *app.add_subcommand("object", "the objects of a running sonard's scene");
  object.require_subcommand(1);
  object.footer(
      "examples:\n"
      "  sonarctl object list\n"
      "  sonarctl object add crate-2 --like crate --xyz 3,1,-5 --material steel\n"
      "  sonarctl object place crate-2 --xyz 4,1,-5 --rpy 0,0,45\n"
      "  sonarctl object hide crate-2\n"
      "to move an object continuously: sonarctl pose circle --object NAME");
  const auto steering = std::make_shared<Steering>();
  const auto arguments = std::make_shared<ObjectArguments>();
  const auto does = [steering](CLI::App& command, const std::string& example, std::function<Result<void>()> what) {
    command.footer("examples:\n  sonarctl object " + example);
    command.callback([steering, what = std::move(what)] { steering->what = what; });
  };

  does(add_object_command(object, "list", "list names, materials, poses", steering, arguments), "list",
       [steering] { return list_objects(steering->control); });

  CLI::App& add = add_object_command(object, "add", "add an object with the shape of another", steering, arguments);
  add.add_option("--like", arguments->added.like, "the object whose shape is used")->required();
  add.add_option("--material", arguments->added.material, "material of the scene (default: that of the other object)");
  add.add_flag("--moving", arguments->added.moving, "the object accepts poses (sonarctl pose --object)");
  arguments->place.add_to(add, true);
  does(add, "add crate-2 --like crate --xyz 3,1,-5", [steering, arguments] {
    control::AddObject wanted = arguments->added;
    wanted.name = arguments->name;
    wanted.in_world = arguments->place.pose();
    return steer(steering->control, wanted, arguments->name + " is in the scene");
  });

  does(add_object_command(object, "remove", "remove an object from the scene", steering, arguments), "remove crate-2",
       [steering, arguments] {
         return steer(steering->control, control::RemoveObject{arguments->name}, arguments->name + " is removed");
       });
  for (const bool visible : {true, false}) {
    const std::string name = visible ? "show" : "hide";
    does(add_object_command(object, name, visible ? "show a hidden object" : "hide an object until it is shown again", steering,
                            arguments),
         name + " crate-2", [steering, arguments, visible] {
           return steer(steering->control, control::SetObject{arguments->name, visible, {}},
                        arguments->name + (visible ? " is shown" : " is hidden"));
         });
  }

  CLI::App& place = add_object_command(object, "place", "move an object", steering, arguments);
  arguments->place.add_to(place, true);
  does(place, "place crate-2 --xyz 4,1,-5 --rpy 0,0,45", [steering, arguments] {
    return steer(steering->control, control::SetObject{arguments->name, {}, arguments->place.pose()},
                 arguments->name + " is placed");
  });
  return run_of(steering);
}

}  // namespace sonar::clients
