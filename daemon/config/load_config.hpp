// Reads and validates configuration files; docs/configuration.md is their manual.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"

namespace sonar {

/// Reads a file. An error has the form file:line:col: key.path: cause, and suggests the nearest valid name.
Result<Config> load_config(const std::filesystem::path& file);
/// Parses a text. `directory`: folder for relative paths; `name`: name of the file in errors.
Result<Config> parse_config(std::string_view yaml, const std::string& name, const std::filesystem::path& directory);
/// Checks that something can advance a lockstep or follow clock. Call it after the command line is applied. Errors: config.
Result<void> check_time_can_pass(const Config& config);
/// Returns the configuration for runs without a file: one Oculus M1200d on 127.0.0.2 that circles through the demo scene. No file
/// is read.
Result<Config> demo_config();

// Finds the configuration for `sonard run`: the given file, else the first one in the usual places, else the demo.

struct FoundConfig {
  Config config;
  std::string how;             // text for the banner: how the file was found
  std::filesystem::path file;  // empty = none
};

/// If `file` is empty, tries ./sonard.yaml, ~/.config/sonard/sonard.yaml and /etc/sonard/sonard.yaml in this order. With
/// `demo` all files are ignored. Errors: those of load_config().
Result<FoundConfig> find_config(const std::string& file, bool demo);

}  // namespace sonar
