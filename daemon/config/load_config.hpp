// Reads and validates configuration files; docs/configuration.md is their manual.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"

namespace sonar {

/// Errors: file:line:col: key.path: what, and the nearest valid name.
Result<Config> load_config(const std::filesystem::path& file);
/// `directory`: start of relative scene paths; `name`: name of the file in errors.
Result<Config> parse_config(std::string_view yaml, const std::string& name, const std::filesystem::path& directory);
/// Checks that something can advance a lockstep or follow clock. Call after applying command-line options. Errors: config.
Result<void> check_time_can_pass(const Config& config);
/// The configuration if no file is found: one Oculus M1200d on 127.0.0.2 that circles through the demo scene. It needs no
/// files.
Result<Config> demo_config();

// Finds the configuration for `sonard run`: the given file, else the first one in the usual places, else the demo.

struct FoundConfig {
  Config config;
  std::string how;             // for the banner
  std::filesystem::path file;  // empty = none
};

/// If `file` is empty: ./sonard.yaml, ~/.config/sonard/sonard.yaml, /etc/sonard/sonard.yaml, in this order. `demo` ignores all
/// files. Errors: those of load_config().
Result<FoundConfig> find_config(const std::string& file, bool demo);

}  // namespace sonar
