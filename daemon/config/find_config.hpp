// Finds the configuration for `sonard run`: the given file, else the first one in the usual places, else the demo.
#pragma once

#include <filesystem>
#include <string>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"

namespace sonar {

struct FoundConfig {
  Config config;
  std::string how;             // for the banner
  std::filesystem::path file;  // empty = none
};

/// If `file` is empty: ./sonard.yaml, ~/.config/sonard/sonard.yaml, /etc/sonard/sonard.yaml, in this order. `demo` ignores all
/// files. Errors: those of load_config().
Result<FoundConfig> find_config(const std::string& file, bool demo);

}  // namespace sonar
