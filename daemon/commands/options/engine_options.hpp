// Options of the engine and of the model's parts, shared by `sonard run`, `sonard render` and the benchmark (tests/bench). Values
// from the command line or the environment override those of the file.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"

namespace CLI {
class App;
}  // namespace CLI

namespace sonar {

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

}  // namespace sonar
