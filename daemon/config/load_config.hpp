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
/// `directory` is where relative scene paths start; `name` stands in errors for the file.
Result<Config> parse_config(std::string_view yaml, const std::string& name, const std::filesystem::path& directory);
/// Checks that a lockstep or follow clock has a source that can advance it. Call after applying command-line options. Errors:
/// config.
Result<void> check_time_can_pass(const Config& config);
/// Configuration when no file is found: one Oculus M1200d on 127.0.0.2 that circles through the demo scene. Needs no files.
Result<Config> demo_config();

}  // namespace sonar
