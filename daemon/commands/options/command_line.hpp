// The options of each command. Only a few .cpp files include CLI11, because it is slow to compile.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/commands/options/queue_options.hpp"
#include "daemon/commands/replay/replay_command.hpp"
#include "daemon/config/config.hpp"

namespace CLI {
class App;
}  // namespace CLI

namespace sonar {

// Options of the engine and of the model's parts, shared by `sonard run`, `sonard render` and the benchmark (tests/bench). Values
// from the command line or the environment override those of the file.

/// Options as given; empty members keep the values of the configuration.
struct EngineOptionsGiven {
  std::string device, simd, mode;
  std::optional<int> threads;
  std::optional<std::uint64_t> seed;
  std::optional<int> fixed_fan;
  bool expected_power = false;
  std::array<std::string, named_switches.size()> switches;  // "on", "off" or empty, in the order of named_switches
};

/// Returns the option of a switch: --side-lobes for `side_lobes`.
std::string option_of(const NamedSwitch& part);

void add_device_option(CLI::App& app, EngineOptionsGiven& given);
/// Adds all options except those for threads (a benchmark varies the threads) and for the device.
void add_model_options(CLI::App& app, EngineOptionsGiven& given);
void add_engine_options(CLI::App& app, EngineOptionsGiven& given);

/// Applies the options. Errors: usage, if an option switches on a part that has no effect in this mode or with this fixed fan.
/// Parts that the file switches on are not checked here.
Result<void> override_engine(EngineConfig& engine, std::uint64_t& seed, const EngineOptionsGiven& given);

struct RunCommand {
  std::string config;  // empty = search the usual places
  bool demo = false;
  std::string demo_of;  // make of the demo's sonar, such as "blueview"; empty = the default
  std::string profile;  // profile of the demo's sonar; empty = the default
  std::uint64_t exit_after_pings = 0;
  bool digest = false;
  // An empty value leaves the value of the configuration.
  std::string clock, log_format, log_level, bind;
  std::optional<int> clients;
  bool faults = false;
  std::string fault_journal;
  int offset = 0;
  EngineOptionsGiven engine;
};
struct RenderCommand {
  std::string config;  // may be empty for the coverage report
  std::string out;
  std::uint64_t first = 1;             // number of the first ping
  std::optional<std::uint64_t> pings;  // nullopt: one, or one per line of a pose file
  std::vector<std::string> formats{"npy", "png"};
  std::optional<double> pose_rate_hz;  // rate of a KITTI file, which has no times
  std::string sonar, poses, pose_frame, report;
  std::string image_rings = "on";
  std::optional<double> rate_hz;
  int batch = 1;
  bool complex = false, labels = false, quiet = false, overwrite = false;
  EngineOptionsGiven engine;
};
struct DatasetCommand {
  std::string job, out, shards;              // shards: "I/N", or empty for all
  std::string export_form, split, split_by;  // "coco" or "folder", or empty; "80,10,10"; "bed_seed,coat"
  std::optional<int> threads;
  bool quiet = false;
};
struct WorkerCommand {
  farm::QueueOptions queue;
  std::string out;
  std::optional<int> threads;
  bool until_empty = false, quiet = false;
};
struct FarmCommand {
  enum class What { submit, status, collect } what = What::status;
  farm::QueueOptions queue;
  std::string job, out, simd;
  double ack_wait_s = 60;
  bool watch = false;
};
struct CheckCommand {
  std::string config;
};
struct Leave {  // after help, version or a usage error, which are already printed
  int exit_code = 0;
};
using Command =
    std::variant<RunCommand, CheckCommand, RenderCommand, DatasetCommand, WorkerCommand, FarmCommand, ReplayCommand, Leave>;

Command parse_command_line(int argc, char** argv);
/// Overrides the values of the file with options of the command line or the environment.
Result<void> override_config(Config& config, const RunCommand& command);

}  // namespace sonar
